"""`solve_events` against closed forms: dosing, a thermostat, the end of a run, order of events."""

from functools import partial

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from hybrid_systems import Clock

DECAY = diffrax.ODETerm(lambda t, y, args: -args * y)
HALF = diffrax.ODETerm(lambda t, y, args: -0.5 * y)
TAYLOR = ij.TaylorStep(order=12)
RATE, TIMES = 0.3, jnp.array([0.0, 1.0, 2.5, 7.0])


def dosed(times, t0=0.0, ts=1.0):
    """One unit more at each time, and decay in between."""
    return ij.solve_events(
        DECAY,
        TAYLOR,
        t0,
        10.0,
        jnp.array(2.0),
        jnp.array(RATE),
        events=[ij.ResetAt(times, lambda t, y, args: y + 1)],
        saveat=diffrax.SaveAt(t0=True, t1=True, ts=jnp.asarray([ts])),
        max_events=6,
        max_steps=128,
    )


dosed_jit = jax.jit(dosed)


def test_dosing():
    own = dosed_jit(TIMES)
    start = 2 * np.exp(-10 * RATE)
    np.testing.assert_allclose(own.ys[0], 3.0)  # after the dose at the start
    np.testing.assert_allclose(own.ys[1], 3 * np.exp(-RATE) + 1, rtol=1e-8)
    np.testing.assert_allclose(own.ys[2], start + np.sum(np.exp(-RATE * (10 - TIMES))), rtol=1e-7)
    np.testing.assert_array_equal(own.events.t[:4], TIMES)


def test_dosing_by_its_times():
    slope = jax.jit(jax.grad(lambda times: dosed(times).ys[2]))(TIMES)
    np.testing.assert_allclose(slope, RATE * np.exp(-RATE * (10 - TIMES)), rtol=1e-6)


def test_times_before_the_start_are_left_out():
    own = dosed_jit(TIMES, 1.5, 2.0)
    np.testing.assert_array_equal(own.events.t[:3], [2.5, 7.0, np.nan])


def test_infinite_times_never_come():
    own = dosed_jit(jnp.array([1.0, 2.0, jnp.inf, jnp.inf]))
    assert own.events.count == 2
    assert own.result == ij.RESULTS.successful


@pytest.mark.parametrize("solver", [TAYLOR, diffrax.Dopri5()])
@pytest.mark.parametrize("gap", [1e-6, 1e-9, 1e-12, 4e-16])
def test_times_within_the_tolerance_of_each_other(gap, solver):
    times = np.array([1.0, 1.0 + gap, 7.0])
    own = events_at(jnp.asarray(times), 0.0, solver)
    assert own.events.count == 3
    assert own.result == ij.RESULTS.successful
    np.testing.assert_allclose(own.ys[0], np.sum(np.exp(-RATE * (10 - times))), rtol=2e-8)


@pytest.mark.parametrize("t0", [1e6, 1.7e9, -1e9])
def test_times_of_a_clock_that_started_long_ago(t0):
    times = np.array([1.0, 2.5, 7.0])
    own = events_at(jnp.asarray(t0 + times), t0)
    assert own.events.count == 3
    np.testing.assert_allclose(own.events.t[:3] - t0, times, atol=1e-6)
    np.testing.assert_allclose(own.ys[0], np.sum(np.exp(-RATE * (10 - times))), rtol=1e-6)


@partial(jax.jit, static_argnums=2)
def events_at(times, t0, solver=TAYLOR):
    """Decay for 10 from nothing, with one unit more at each time."""
    dose = ij.ResetAt(times, lambda t, y, args: y + 1)
    start = jnp.array(0.0)
    return ij.solve_events(DECAY, solver, t0, t0 + 10, start, jnp.array(RATE), events=[dose])


def test_three_times_at_once():
    near = dosed_jit(jnp.array([1.0, 1.0 + 1e-12, 1.0 + 2e-12, 4.0]))
    assert near.result == ij.RESULTS.non_finite


def test_times_out_of_order():
    with pytest.raises(ValueError, match="`times` must increase strictly"):
        dosed(jnp.array([1.0, 1.0, 2.0]))
    assert dosed_jit(jnp.array([1.0, 3.0, 2.0, 4.0])).result == ij.RESULTS.non_finite


def test_commuting_and_other_resets():
    """At t = 1: +0.1 and −0.3 in either order, and +0.1 before or after doubling."""
    add, double = (lambda t, y, a: y + 0.1), (lambda t, y, a: 2 * y)
    one = jnp.array([1.0])

    def both(second):
        events = [ij.ResetAt(one, add), ij.ResetAt(one, second)]
        return ij.solve_events(
            DECAY, TAYLOR, 0.0, 2.0, jnp.array([0.1]), jnp.array(0.0), events=events, max_events=3
        ).events

    commute, other = both(lambda t, y, a: y - 0.3), both(double)
    np.testing.assert_array_equal(commute.order_matters, [False, False, False])
    np.testing.assert_array_equal(other.order_matters, [True, True, False])
    np.testing.assert_array_equal(other.transition, [0, 1, -1])


class Timer(Clock):
    """A run that ends when the polynomial falls."""

    def transitions(self):
        (own,) = super().transitions()
        return [own._replace(jump=None)]


def test_the_end_of_a_run_lasts():
    timer, start = Timer(jnp.array([-1.0, 1.5])), ij.Start(0.0, jnp.ones(1))
    own = ij.solve(timer, start, jnp.array([1.0, 2.0]), max_events=2, max_steps=32)
    np.testing.assert_array_equal(own.ys[:, 0], [1.0, np.nan])
    assert own.final.t == 1.5
    after = ij.solve(timer, own.final, jnp.array([2.0, 3.0]), max_events=2, max_steps=32)
    assert np.all(np.isnan(after.ys))
    assert after.events.count == 0


def test_an_event_that_ends_the_run_gives_its_state():
    def end(level):
        event = ij.Reset(lambda t, y, args: y[0] - args)
        saveat = diffrax.SaveAt(t0=True, t1=True)
        return ij.solve_events(
            HALF, TAYLOR, 0.0, 9.0, jnp.array([1.0]), level, events=[event], saveat=saveat
        )

    own = end(jnp.array(0.25))
    np.testing.assert_allclose(own.ts, [0.0, 2 * np.log(4.0)], rtol=1e-9)
    np.testing.assert_allclose(own.ys[:, 0], [1.0, 0.25], rtol=1e-9)
    slope = jax.jacfwd(lambda level: end(level).ts[1])(jnp.array(0.25))
    np.testing.assert_allclose(slope, -2 / 0.25, rtol=1e-8)
    never = end(jnp.array(-1.0))
    np.testing.assert_allclose(never.ys[1, 0], np.exp(-4.5), rtol=1e-9)


def test_values_that_are_traced_come_by_args():
    def end(level):
        event = ij.Reset(lambda t, y, args: y[0] - level)
        return ij.solve_events(HALF, TAYLOR, 0.0, 9.0, jnp.array([1.0]), events=[event]).ys[0, 0]

    with pytest.raises(ValueError, match="give it by `args`"):
        jax.grad(end)(jnp.array(0.25))


def test_start_stands_for_the_first_state():
    with pytest.raises(ValueError, match="either `y0` or"):
        ij.solve_events(DECAY, TAYLOR, 0.0, 9.0, None, jnp.array(0.5), events=[])
