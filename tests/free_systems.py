"""Hybrid systems that do not depend on time, for the tests of their orbits."""

import abc

import jax
import jax.numpy as jnp

import impactjax as ij


class VanDerPol(ij.HybridSystem):
    """x″ = (1 − x²) x′ − x."""

    def flow(self, t, y, mode):
        return {"x": y["v"], "v": (1 - y["x"] ** 2) * y["v"] - y["x"]}

    def transitions(self):
        return []


class Escapement(ij.HybridSystem):
    """x″ + 2 ζ x′ + x = 0 with a kick that adds `gain` to x′² where x rises through zero, and a
    stop of restitution 0.5 at x = 1.
    """

    zeta: jax.Array
    gain: jax.Array

    def flow(self, t, y, mode):
        return {"x": y["v"], "v": -2 * self.zeta * y["v"] - y["x"]}

    def transitions(self):
        return [
            ij.Transition(lambda t, y, mode: 1 - y["x"], self.impact),
            ij.Transition(lambda t, y, mode: -y["x"], self.kick),
        ]

    def impact(self, t, y, mode):
        return {**y, "v": -0.5 * y["v"]}, mode

    def kick(self, t, y, mode):
        return {**y, "v": jnp.sqrt(y["v"] ** 2 + self.gain)}, mode


class Rings(ij.HybridSystem):
    """r′ = r (a + b r² − r⁴), φ′ = 1 + r² in the plane."""

    a: jax.Array
    b: jax.Array

    def flow(self, t, y, mode):
        square = y @ y
        growth = self.a + self.b * square - square**2
        return growth * y + (1 + square) * jnp.stack([-y[1], y[0]])

    def transitions(self):
        return []


class Roessler(ij.HybridSystem):
    """x′ = −y − z, y′ = x + y/5, z′ = 1/5 + z (x − c)."""

    c: jax.Array

    def flow(self, t, y, mode):
        x, own, z = y["x"], y["y"], y["z"]
        return {"x": -own - z, "y": x + own / 5, "z": 0.2 + z * (x - self.c)}

    def transitions(self):
        return []


class Firing(ij.HybridSystem):
    """A phase that rises with 1 + y₁/2 up to 1, and a map y → image(y) at its return to 0."""

    rate: jax.Array

    def flow(self, t, y, mode):
        return {"phase": 1 + y["own"][0] / 2, "own": jnp.zeros_like(y["own"])}

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: 1 - y["phase"], self.fire)]

    def fire(self, t, y, mode):
        return {"phase": jnp.zeros_like(t), "own": self.image(y["own"])}, mode

    @abc.abstractmethod
    def image(self, y) -> jax.Array:
        """The numbers after the event."""


class Logistic(Firing):
    """The map y → a y (1 − y)."""

    def image(self, y):
        return self.rate * y * (1 - y)


class Delayed(Firing):
    """The map (x, y) → (y, a y (1 − x))."""

    def image(self, y):
        return jnp.stack([y[1], self.rate * y[1] * (1 - y[0])])
