"""Forced hybrid systems for the tests of the forced response."""

import abc

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij

TRACED = []  # one entry for each time that the flow of model V is traced


class ModelV(ij.HybridSystem):
    """x″ + 0.04 x′ + x + 1 = A cos ωt, with a stop at x = 0 of restitution 0.9."""

    amplitude: jax.Array
    frequency: jax.Array

    def flow(self, t, y, mode):
        TRACED.append(1)
        force = self.amplitude * jnp.cos(self.frequency * t)
        return {"x": y["v"], "v": force - 0.04 * y["v"] - y["x"] - 1}

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: -y["x"], self.impact)]

    def impact(self, t, y, mode):
        return {**y, "v": -0.9 * y["v"]}, mode

    def period(self):
        return 2 * np.pi / self.frequency


class Table(ij.HybridSystem):
    """A ball on a table that moves with a sin ωt at 60 Hz, in cm; restitution 0.5."""

    amplitude: jax.Array

    def flow(self, t, y, mode):
        return {"h": y["v"], "v": jnp.full_like(t, -GRAVITY)}

    def transitions(self):
        return [ij.Transition(self.gap, self.bounce)]

    def gap(self, t, y, mode):
        return y["h"] - self.amplitude * jnp.sin(OMEGA * t)

    def bounce(self, t, y, mode):
        table = self.amplitude * OMEGA * jnp.cos(OMEGA * t)
        return {**y, "v": table + 0.5 * (table - y["v"])}, mode


class Map(ij.HybridSystem):
    """A map y → image(y), once a period; its guard rises again."""

    def flow(self, t, y, mode):
        return jnp.zeros_like(y)

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: jnp.cos(2 * np.pi * t), self.kick)]

    def kick(self, t, y, mode):
        return self.image(y), mode

    @abc.abstractmethod
    def image(self, y) -> jax.Array:
        """The state after a kick."""


class Kicked(Map):
    """The delayed logistic map (x, y) → (y, a y (1 − x))."""

    rate: jax.Array

    def image(self, y):
        return jnp.stack([y[1], self.rate * y[1] * (1 - y[0])])


class Circle(Map):
    """The map y → y + (y² + a² − 1) / 5."""

    a: jax.Array

    def image(self, y):
        return y + (y**2 + self.a**2 - 1) / 5


class Below(ij.HybridSystem):
    """x″ + 0.1 x′ + x = A cos ωt, with a stop at x = 1 of restitution 0.8."""

    amplitude: jax.Array
    frequency: jax.Array

    def flow(self, t, y, mode):
        x, v = y
        return v, self.amplitude * jnp.cos(self.frequency * t) - 0.1 * v - x

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: 1 - y[0], self.impact)]

    def impact(self, t, y, mode):
        return (y[0], -0.8 * y[1]), mode

    def period(self):
        return 2 * np.pi / self.frequency


GRAVITY, OMEGA = 981.0, 2 * np.pi * 60
MODEL_V = ModelV(jnp.array(0.36), jnp.array(0.81))
REST = ij.Start(0.0, {"x": -1.0, "v": 0.0})
