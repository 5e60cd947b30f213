"""Hybrid systems for the tests of the general engine."""

import jax
import jax.numpy as jnp

import impactjax as ij


class Ball(ij.HybridSystem):
    """A ball on a floor; an impact slower than `slow` leads to rest at once. Mode 1 is rest."""

    gravity: jax.Array
    restitution: jax.Array
    slow: jax.Array

    def flow(self, t, y, mode):
        rests = mode == 1
        return {
            "x": jnp.where(rests, 0.0, y["v"]),
            "v": jnp.where(rests, 0.0, -self.gravity),
        }

    def transitions(self):
        return [ij.Transition(self.height, self.bounce, self.rest)]

    def height(self, t, y, mode):
        return jnp.where(mode == 1, 1.0, y["x"])

    def bounce(self, t, y, mode):
        return {**y, "v": -self.restitution * y["v"]}, mode

    def rest(self, t, y, mode):
        duration = 2 * y["v"] / (self.gravity * (1 - self.restitution))
        still = {"x": 0.0, "v": 0.0}
        return ij.Tail(y["v"] < self.slow, duration, still, jnp.ones_like(mode))


class Neurons(ij.HybridSystem):
    """Two neurons v′ = I − v with threshold 1 and reset to 0, each of which pushes the other."""

    current: jax.Array
    push: jax.Array

    def flow(self, t, y, mode):
        return self.current - y

    def transitions(self):
        return [self.neuron(0), self.neuron(1)]

    def neuron(self, own):
        def fire(t, y, mode):
            return y.at[own].set(0.0).at[1 - own].add(self.push), mode

        return ij.Transition(lambda t, y, mode: 1 - y[own], fire)


class Oscillator(ij.HybridSystem):
    """A forced linear oscillator above a rigid stop at x = −1."""

    zeta: jax.Array
    amplitude: jax.Array
    frequency: jax.Array
    restitution: jax.Array

    def flow(self, t, y, mode):
        force = self.amplitude * jnp.cos(self.frequency * t)
        return {"x": y["v"], "v": force - y["x"] - 2 * self.zeta * y["v"]}

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: y["x"] + 1, self.bounce)]

    def bounce(self, t, y, mode):
        return {**y, "v": -self.restitution * y["v"]}, mode


class Clock(ij.HybridSystem):
    """Counters that do not flow; one counts the falls of a polynomial of time."""

    coefficients: jax.Array

    def flow(self, t, y, mode):
        return jnp.zeros_like(y)

    def transitions(self):
        def guard(t, y, mode):
            value = jnp.zeros_like(t)
            for coefficient in self.coefficients:
                value = value * t + coefficient
            return value

        return [ij.Transition(guard, lambda t, y, mode: (y + 1, mode))]
