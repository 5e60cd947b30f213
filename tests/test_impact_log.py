"""The impact log and the rest log against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._simulate.chandrupatla import Bracket, falling_zero
from tiers import thorough

MASS, OMEGA0, GAMMA, SPEED = 0.02, 700.0, 0.2, 0.8
SERIES = ij.TaylorStep(order=8)  # compiles faster than the usual one


def strike(parameters):
    """The impact of a free mass on a Kelvin-Voigt stop."""
    omega0, gamma, speed = parameters
    model = ij.ImpactOscillator(ij.FreeMass(MASS), ij.Stop(ij.KelvinVoigt(omega0, gamma)))
    run = ij.simulate(
        model,
        ij.InitialState(0.01, -speed),
        jnp.array([0.0, 0.1]),
        step=SERIES,
        tolerance=1e-12,
        max_steps=128,
        max_impacts=2,
    )
    return jnp.stack([run.deepest_penetration[0], run.peak_force[0]])


PARAMETERS = jnp.array([OMEGA0, GAMMA, SPEED])


def exact(parameters):
    """The same by its formula: the force peaks where ω_d t = arctan(√(1−γ²)(1−4γ²)/(γ(3−4γ²)))."""
    omega0, gamma, speed = parameters
    root = jnp.sqrt(1 - gamma**2)
    rate = omega0 * root

    def motion(t):
        depth = speed / rate * jnp.exp(-gamma * omega0 * t) * jnp.sin(rate * t)
        speed_now = speed * jnp.exp(-gamma * omega0 * t) * jnp.cos(rate * t)
        speed_now -= gamma * omega0 * depth
        return depth, MASS * omega0 * (omega0 * depth + 2 * gamma * speed_now)

    deepest = motion(jnp.arctan2(root, gamma) / rate)[0]
    angle = jnp.arctan2(root * (1 - 4 * gamma**2), gamma * (3 - 4 * gamma**2))
    return jnp.stack([deepest, motion(angle / rate)[1]])


def test_deepest_penetration_and_peak_force():
    np.testing.assert_allclose(strike(PARAMETERS), exact(PARAMETERS), rtol=1e-11)


def test_impact_log_derivatives():
    forward = jax.jit(jax.jacfwd(strike))(PARAMETERS)
    backward = jax.jit(jax.jacrev(strike))(PARAMETERS)
    np.testing.assert_allclose(forward, jax.jacfwd(exact)(PARAMETERS), rtol=1e-9)
    np.testing.assert_allclose(forward, backward, rtol=1e-12)


@thorough
def test_impact_log_second_derivatives():
    ours = jax.jit(jax.jacfwd(jax.jacfwd(strike)))(PARAMETERS)
    theirs = jax.jacfwd(jax.jacfwd(exact))(PARAMETERS)
    scale = jnp.max(jnp.abs(theirs))
    np.testing.assert_allclose(ours / scale, theirs / scale, atol=1e-9)


def turn(rate, a, high):
    """Zero below `high` of a falling rate with the parameter a."""
    low, high = jnp.zeros(()), jnp.full((), high)
    return falling_zero(rate, Bracket(low, rate(low, a), high, rate(high, a)), a)


def test_turning_points_have_derivatives_of_any_order():
    """The top of a s − s⁴/4 is at s = a^(1/3), and 3/4 a^(4/3) high."""

    def top(a):
        s = turn(lambda s, a: a - s**3, a, 5.0)
        return jnp.stack([s, a * s - s**4 / 4])

    def exact(a):
        return jnp.stack([a ** (1 / 3), 3 / 4 * a ** (4 / 3)])

    at = jnp.array(1.7)
    for _ in range(4):
        np.testing.assert_allclose(jax.jit(top)(at), exact(at), rtol=1e-12)
        top, exact = jax.jacfwd(top), jax.jacfwd(exact)


@pytest.mark.parametrize(
    "rate",
    [
        lambda s, a: a - s,
        lambda s, a: -jnp.tanh(50 * (s - a)),
        lambda s, a: (a - s) + 50 * (a - s) ** 3,
        lambda s, a: (a - s) ** 3,
        lambda s, a: jnp.exp(-20 * s) - jnp.exp(-20 * a),
    ],
)
@pytest.mark.parametrize("a", [1e-9, 0.7, 1.99])
def test_turning_points_are_exact_to_rounding(rate, a):
    np.testing.assert_allclose(jax.jit(lambda a: turn(rate, a, 2.0))(a), a, rtol=1e-12, atol=1e-15)


def test_strongly_damped_force_peaks_at_touch():
    peak = strike(jnp.array([OMEGA0, 0.7, SPEED]))[1]
    np.testing.assert_allclose(peak, MASS * 2 * 0.7 * OMEGA0 * SPEED, rtol=1e-12)


def shaken(parameters, step: ij.AbstractStep = SERIES):
    """A ball on a floor that shakes slowly enough for it to come to rest and be thrown again."""
    r, amplitude = parameters
    base = ij.HarmonicMotion(amplitude, 10.0)
    model = ij.ImpactOscillator(ij.BouncingBall(base=base), ij.Stop(ij.Restitution(r)))
    times = jnp.linspace(0.0, 1.2, 13)
    return ij.simulate(
        model, ij.InitialState(0.0, 0.1), times, step=step, tolerance=1e-10, max_steps=512
    )


@thorough
def test_rest_of_many_steps_is_one_row():
    """A Runge-Kutta step that meets the release is tried again: still the same rests."""
    parameters = jnp.array([0.3, 0.15])
    known = jax.jit(shaken)(parameters).rests
    tried = jax.jit(lambda p: shaken(p, ij.RungeKutta()))(parameters).rests
    assert known.count == tried.count >= 2
    np.testing.assert_allclose(tried.begin, known.begin, atol=1e-8)
    np.testing.assert_allclose(tried.end, known.end, atol=1e-8)


def test_rest_ends_when_floor_accelerates_away():
    """AΩ² sin Ωt = g at release: sin of the first angle beyond rest is g / AΩ²."""
    parameters = jnp.array([0.3, 0.15])
    run = jax.jit(shaken)(parameters)
    assert run.result == ij.RESULTS.successful
    release = np.arcsin(9.80665 / (0.15 * 100)) / 10
    assert run.rests.released[0]
    expected = release if run.rests.begin[0] < release else release + 2 * np.pi / 10
    np.testing.assert_allclose(run.rests.end[0], expected, rtol=1e-10)
    slope = jax.jit(jax.jacfwd(lambda p: shaken(p).rests.end[0]))(parameters)
    ratio = 9.80665 / (0.15 * 100)
    np.testing.assert_allclose(slope[1], -ratio / 0.15 / 10 / np.sqrt(1 - ratio**2), rtol=1e-8)
    np.testing.assert_allclose(slope[0], 0.0, atol=1e-12)


@pytest.mark.parametrize("r", [0.05, 0.5, 0.9, 0.99])
def test_ball_rests_at_sum_of_its_flights(r):
    """T = t1 + 2 r v1 / (g (1 − r)), and its derivative."""
    height, g = 1e-3 if r > 0.95 else 0.05, 9.80665

    def rest(r):
        run = drop(r, height)
        return run.rests.begin[0]

    first = np.sqrt(2 * height / g)
    expected = first + 2 * r * first / (1 - r)
    slope = 2 * first / (1 - r) ** 2
    value, derivative = jax.jvp(rest, (r,), (1.0,))
    np.testing.assert_allclose(value, expected, atol=1e-9)
    np.testing.assert_allclose(derivative, slope, atol=1e-8)
    run = drop(r, height)
    assert np.all(run.position >= 0)


@thorough
def test_reverse_derivatives_pass_a_rest():
    """Also those of what was before it, and of balls beside it that never rest."""

    def told(r):
        run = drop(r, 0.2)
        return jnp.stack([run.rests.begin[0], run.position[50], run.impacts.time[0]])

    bounces = jnp.array([0.8, 0.99, 1.0, 0.0])
    forward = jax.jit(jax.vmap(jax.jacfwd(told)))(bounces)
    reverse = jax.jit(jax.vmap(jax.jacrev(told)))(bounces)
    np.testing.assert_allclose(reverse, forward, rtol=1e-12)
    slope = 2 * np.sqrt(2 * 0.2 / 9.80665) / (1 - 0.8) ** 2
    np.testing.assert_allclose(reverse[0, 0], slope, rtol=1e-8)


@jax.jit
def drop(r, height):
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(r)))
    return ij.simulate(
        model,
        ij.InitialState(height),
        jnp.linspace(0.0, 5.0, 501),
        step=ij.TaylorStep(order=4),  # which is exact
        tolerance=1e-11,
        max_steps=1024,
        max_impacts=900,
    )


def test_nearest_miss_of_swing_is_its_turning_point():
    """An undamped swing of 0.1 m turns 0.02 m before a stop at −0.12 m."""
    model = ij.ImpactOscillator(ij.LinearOscillator(10.0), ij.Stop(ij.Restitution(0.5), gap=0.12))
    ts = jnp.linspace(0.0, 2.0, 11)
    run = ij.simulate(model, ij.InitialState(0.1), ts, step=SERIES, tolerance=1e-12)
    assert run.impacts.count == 0
    np.testing.assert_allclose(run.nearest_miss, 0.02, rtol=1e-10)
