"""Derivatives of hybrid systems where the motion itself shows nothing of them."""

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij


class Decay(ij.HybridSystem):
    """A decay that a harmonic force drives, with an event at `time`, after which the rate is
    another one.
    """

    rates: jax.Array
    amplitude: jax.Array
    time: jax.Array

    def flow(self, t, y, mode):
        rate = jnp.where(mode == 0, self.rates[0], self.rates[1])
        return self.amplitude * jnp.sin(9.0 * t) - rate * y

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: self.time - t, lambda t, y, mode: (y, mode + 1))]


TS = jnp.array([0.5, 1.0, 3.0, 6.0])
RATES = jnp.array([0.7, 2.0])


def states(y0, amplitude, time):
    return ij.solve(Decay(RATES, amplitude, time), ij.Start(0.0, y0), TS, tolerance=1e-11).ys


def closed(y0, amplitude, time):
    """The same in closed form."""

    def forced(rate, t):
        return amplitude * (rate * jnp.sin(9 * t) - 9 * jnp.cos(9 * t)) / (rate**2 + 81)

    def decayed(y, rate, begin, t):
        return forced(rate, t) + (y - forced(rate, begin)) * jnp.exp(-rate * (t - begin))

    middle = decayed(y0, RATES[0], 0.0, time)
    later = decayed(middle, RATES[1], time, TS)
    return jnp.where(time > TS, decayed(y0, RATES[0], 0.0, TS), later)


def agree(place):
    for forward in (jax.jacfwd, jax.jacrev):
        found = forward(states, (0, 1, 2))(*place)
        expected = jax.jacfwd(closed, (0, 1, 2))(*place)
        for own, reference in zip(found, expected, strict=True):
            np.testing.assert_allclose(own, reference, rtol=1e-8, atol=1e-9)


def test_state_at_rest_has_derivatives():
    agree((jnp.array(0.0), jnp.array(0.0), jnp.array(2.0)))


def test_change_of_mode_without_a_jump_has_a_derivative_by_its_time():
    agree((jnp.array(1.5), jnp.array(0.8), jnp.array(0.8)))


def test_error_of_a_derivative_falls_with_the_tolerance():
    def error(tolerance):
        def state(amplitude):
            system = Decay(RATES, amplitude, jnp.array(2.0))
            return ij.solve(system, ij.Start(0.0, 1.0), TS, tolerance=tolerance).ys

        own = jax.jacfwd(state)(jnp.array(0.0))
        expected = jax.jacfwd(closed, 1)(jnp.array(1.0), jnp.array(0.0), jnp.array(2.0))
        return float(jnp.max(jnp.abs(own - expected)))

    coarse, fine = error(1e-5), error(1e-10)
    assert fine < 1e-3 * coarse or fine < 1e-10
    assert coarse < 1e-3
