"""Sections: stroboscopic, at events, and through a surface."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij


class Forced(ij.HybridSystem):
    """A forced linear oscillator, with a stop at −`gap`."""

    amplitude: jax.Array
    gap: jax.Array

    def flow(self, t, y, mode):
        x, v = y
        return v, -x - 0.2 * v + self.amplitude * jnp.cos(2.2 * t)

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: y[0] + self.gap, self.bounce)]

    def bounce(self, t, y, mode):
        return (y[0], -0.7 * y[1]), mode


PERIOD = 2 * np.pi / 2.2
FREE = Forced(jnp.array(1.0), jnp.array(50.0))
STOPPED = Forced(jnp.array(1.0), jnp.array(0.2))
START = ij.Start(0.0, (0.3, 0.0))


def steady(amplitude):
    """State of the steady oscillation without a stop, at t = 0."""
    factor = amplitude / (1 - 2.2**2 + 0.2j * 2.2)
    return factor.real, (2.2j * factor).real


def test_stroboscopic_section_reaches_the_steady_oscillation():
    found = ij.section(FREE, START, ij.Every(PERIOD), keep=3, skip=200, tolerance=1e-12)
    assert found.result == ij.RESULTS.successful
    np.testing.assert_allclose(found.t, PERIOD * np.arange(201, 204), rtol=1e-14)
    for own, expected in zip(found.after, steady(1.0), strict=True):
        np.testing.assert_allclose(own, expected, atol=1e-10)


def test_section_is_the_solution_at_the_same_times():
    found = ij.section(STOPPED, START, ij.Every(PERIOD), keep=20, skip=5, tolerance=1e-12)
    run = ij.solve(STOPPED, START, found.t, tolerance=1e-12, max_events=128)
    assert int(run.events.count) > 20
    np.testing.assert_allclose(found.after[0], run.ys[0], atol=1e-8)
    rest = ij.section(STOPPED, found.final, ij.Every(PERIOD), keep=4, tolerance=1e-12)
    whole = ij.section(STOPPED, START, ij.Every(PERIOD), keep=4, skip=25, tolerance=1e-12)
    np.testing.assert_array_equal(rest.after[0], whole.after[0])
    np.testing.assert_array_equal(rest.t, whole.t)


def test_section_at_events_holds_both_states():
    found = ij.section(STOPPED, START, ij.AtTransition(0), keep=6)
    run = ij.solve(STOPPED, START, [30.0], max_events=6)
    np.testing.assert_allclose(found.t, run.events.t, rtol=1e-12)
    np.testing.assert_allclose(found.after[1], -0.7 * found.before[1], rtol=1e-14)


def test_section_through_a_surface():
    found = ij.section(FREE, START, ij.Through(lambda t, y, mode: y[1]), keep=4)
    np.testing.assert_allclose(found.after[1], 0.0, atol=1e-12)
    assert np.all(np.asarray(found.after[0]) > 0)  # the speed falls through zero at a maximum
    assert np.all(np.diff(found.t) > 0.5 * PERIOD)


def test_derivative_of_a_section():
    def state(amplitude):
        system = eqx.tree_at(lambda each: each.amplitude, FREE, amplitude)
        return ij.section(system, START, ij.Every(PERIOD), keep=1, skip=200, tolerance=1e-12).after

    slope = jax.jacfwd(state)(jnp.array(1.0))
    for own, expected in zip(slope, steady(1.0), strict=True):  # it is linear in the amplitude
        np.testing.assert_allclose(own[0], expected, atol=1e-9)


def test_surface_that_is_never_reached():
    found = ij.section(FREE, START, ij.AtTransition(0), keep=1)
    assert found.result == ij.RESULTS.max_steps_reached
    assert np.all(np.isnan(found.t))


def test_lanes_of_a_system_without_transitions():
    class Decay(ij.HybridSystem):
        rate: jax.Array

        def flow(self, t, y, mode):
            return -self.rate * y

        def transitions(self):
            return []

    def end(rate):
        return ij.solve(Decay(rate), ij.Start(0.0, 1.0), [1.0], max_steps=64, max_events=1).ys[0]

    rates = jnp.array([0.5, 2.0])
    np.testing.assert_allclose(jax.vmap(end)(rates), np.exp([-0.5, -2.0]), rtol=1e-8)
