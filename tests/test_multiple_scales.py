"""Multiple scales against the printed formulas and the exact pendulum; the piecewise trajectory."""

import functools
import math

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from scipy.optimize import least_squares, root

import impactjax as ij
from printed import LENGTH, OMEGA_N, ZETA, case_1, case_2, exact, general, zero
from reference import derivative, richardson
from tiers import mostly_thorough, thorough

PENDULUM = ij.Pendulum(OMEGA_N, ZETA, length=LENGTH)
TS = np.linspace(0.0, 5.0, 101)
STATES = [(0.7, 0.0), (0.0, 9.0), (0.5, -6.0), (-0.3, 4.0), (-0.2, -8.0)]


def decay(state, ts=TS, omega_n=OMEGA_N, zeta=ZETA):
    """Position and velocity by the package."""
    pendulum = ij.Pendulum(omega_n, zeta, length=LENGTH)
    solution = ij.MultipleScales(pendulum, ij.InitialState(*state))
    return np.asarray(solution.position(ts)), np.asarray(solution.velocity(ts))


def test_multiple_scales_cases_1_and_2():
    np.testing.assert_allclose(decay((0.7, 0.0)), case_1(TS, 0.7), atol=1e-11)
    np.testing.assert_allclose(decay((0.0, 9.0)), case_2(TS, 9.0), atol=1e-11)


@pytest.mark.parametrize("state", STATES)
def test_multiple_scales_general_state(state):
    def mismatch(constants):
        position, velocity = general(0.0, *constants)
        return [position - state[0], (velocity - state[1]) / OMEGA_N]

    a0 = math.hypot(state[0], state[1] / OMEGA_N)
    near = math.atan2(-state[1] / OMEGA_N, state[0]) - a0**2 / (32 * ZETA)
    found = root(mismatch, [1.02 * a0, near + 0.1], tol=1e-12)
    assert found.success
    np.testing.assert_allclose(decay(state), general(TS, *found.x), rtol=0, atol=1e-9)


def test_multiple_scales_without_damping():
    expected = 0.6 * np.cos(OMEGA_N * TS * (1 - 0.36 / 16))
    np.testing.assert_allclose(decay((0.6, 0.0), zeta=0.0)[0], expected, atol=1e-13)


def test_multiple_scales_at_small_amplitude():
    small, zeta = 1e-5, 0.01
    damped = OMEGA_N * math.sqrt(1 - zeta**2)
    linear = small * np.exp(-zeta * OMEGA_N * TS) * np.sin(damped * TS)
    found = decay((0.0, damped * small), zeta=zeta)[0]
    late = (OMEGA_N - damped) * TS * small
    assert np.all(np.abs(found - linear) <= late + zeta**2 * small)
    assert np.max(np.abs(found - linear)) > 0.1 * late.max()


@pytest.mark.parametrize("angle", [math.pi / 2, -math.pi / 2, math.pi])
def test_multiple_scales_time_to_turn(angle):
    solution = ij.MultipleScales(PENDULUM, ij.InitialState(0.7))

    def argument(t):
        return OMEGA_N * t + 0.7**2 / (32 * ZETA) * math.expm1(-2 * ZETA * OMEGA_N * t) - angle

    expected = zero(argument, -0.3, 0.3)
    assert float(solution.time_to_turn(angle)) == pytest.approx(expected, rel=1e-12)


def test_multiple_scales_time_to_turn_derivatives():
    def package(omega, zeta, theta0):
        solution = ij.MultipleScales(ij.Pendulum(omega, zeta), ij.InitialState(theta0))
        return solution.time_to_turn(math.pi / 2)

    def formula(omega, zeta, theta0):
        def argument(t):
            fallen = mpmath.expm1(-2 * zeta * omega * t)
            return omega * t + theta0**2 / (32 * zeta) * fallen - mpmath.pi / 2

        return mpmath.findroot(argument, 0.12)

    values = [OMEGA_N, 0.05, 0.7]
    found = jax.jit(jax.grad(package, argnums=(0, 1, 2)))(*map(jnp.asarray, values))
    expected = [derivative(formula, values, index) for index in range(3)]
    # pi/2 in double precision is what limits the agreement
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_multiple_scales_under_jit_vmap_and_grad():
    @jax.jit
    @functools.partial(jax.vmap, in_axes=(None, None, 0, 0))
    @functools.partial(jax.value_and_grad, argnums=(0, 1, 2, 3))
    def position(omega, zeta, theta0, speed):
        pendulum = ij.Pendulum(omega, zeta)
        return ij.MultipleScales(pendulum, ij.InitialState(theta0, speed)).position(0.8)

    def printed(omega, zeta, theta0, speed):
        # one of the two is zero
        first = case_1(mpmath.mpf(0.8), theta0, omega, zeta, mpmath)[0]
        return first + case_2(mpmath.mpf(0.8), speed, omega, zeta, mpmath)[0]

    values, slopes = position(
        jnp.asarray(OMEGA_N), jnp.asarray(ZETA), jnp.array([0.7, 0.0]), jnp.array([0.0, 9.0])
    )
    for lane, state in enumerate([(0.7, 0.0), (0.0, 9.0)]):
        numbers = [OMEGA_N, ZETA, *state]
        assert float(values[lane]) == pytest.approx(float(printed(*numbers)), abs=1e-13)
        for index in (0, 1, 2 if state[0] else 3):
            expected = derivative(printed, numbers, index)
            assert float(slopes[index][lane]) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("degrees", [10, 45, 90])
def test_multiple_scales_bias_as_documented(degrees):
    amplitude = math.radians(degrees)

    def falls(t, y):
        return y[0]

    run = exact([amplitude, 0.0], events=falls, zeta=0.0)
    crossings, speed = run.t_events[0], -run.y_events[0][0][1]
    solution = ij.MultipleScales(ij.Pendulum(OMEGA_N), ij.InitialState(amplitude))
    crossing = float(solution.time_to_turn(math.pi / 2))
    too_fast = -float(solution.velocity(crossing)) / speed - 1
    assert too_fast == pytest.approx(amplitude**2 / 24, rel=0.12)
    turns = math.pi * np.arange(len(crossings)) + math.pi / 2
    late = np.asarray(solution.time_to_turn(turns)) - crossings
    drift = OMEGA_N * np.polyfit(crossings, late, 1)[0]
    assert drift == pytest.approx(OMEGA_N * amplitude**4 / 3072, rel=0.35)


def literal_chain(state, r, ts, impacts, omega=OMEGA_N, zeta=ZETA):
    """Cases 1 and 2 one after the other, with impact times by bisection."""
    rate = 0.0
    begin, out, times, speeds = 0.0, np.full(len(ts), np.nan), [], []
    flight = functools.partial(case_1, theta0=state, omega=omega, zeta=zeta)
    for _ in range(impacts):
        late = math.pi / omega * (0.8 if not times else 1.2)
        soon = math.pi / omega * (0.4 if not times else 0.8)
        duration = zero(lambda t, flight=flight: flight(t)[0], soon, late)
        inside = (ts >= begin) & (ts < begin + duration)
        out[inside] = flight(ts[inside] - begin)[0]
        begin, rate = begin + duration, -flight(duration)[1]
        times.append(begin)
        speeds.append(rate)
        flight = functools.partial(case_2, v=r * rate, omega=omega, zeta=zeta)
    return out, np.array(times), np.array(speeds)


FINE = np.linspace(0.0, 1.2, 121)
EARLY = 57  # samples before the third impact, away from it


@jax.jit
@functools.partial(jax.jacfwd, has_aux=True)
def piecewise(parameters):
    omega, zeta, r, theta0 = parameters
    found = ij.piecewise_analytical(
        ij.Pendulum(omega, zeta, length=LENGTH),
        ij.Restitution(r),
        ij.InitialState(theta0),
        max_impacts=4,
    )
    position = found.position(FINE)
    return jnp.append(position[:EARLY], found.impact_time[-1]), (found, position)


def both_fits(degrees):
    """ω_n and ζ of a noisy free decay by the exact motion, their errors, and by the formula."""
    ts = jnp.arange(0.0, 10.0, 0.002)
    swing = ij.ImpactOscillator(ij.Pendulum(OMEGA_N, ZETA))
    start = ij.InitialState(math.radians(degrees))
    noise = np.radians(0.2) * np.random.default_rng(0).standard_normal(len(ts))
    record = ij.simulate(swing, start, ts, max_steps=1024).position + noise

    @jax.jit
    def left(p):
        pendulum = ij.Pendulum(p[0], p[1])
        return ij.MultipleScales(pendulum, ij.InitialState(p[2], p[3])).position(ts) - record

    guess = [OMEGA_N, ZETA, math.radians(degrees), 0.0]
    formula = least_squares(left, guess, "3-point").x[:2]
    exact = ij.fit(ij.Experiment(swing, ij.Recording(ts, record, ij.Angle()), start))
    assert exact.names[:2] == ("omega_n", "zeta")
    return np.asarray(exact.values[:2]), np.asarray(exact.standard_errors[:2]), formula


@thorough
def test_small_free_decay_fits_agree():
    exact, errors, formula = both_fits(5)
    assert np.all(np.abs(formula - exact) < errors / 4)
    assert np.all(np.abs(exact - [OMEGA_N, ZETA]) < 3 * errors)


@pytest.mark.parametrize(
    ("degrees", "bias"),
    mostly_thorough([(45, (2.5e-4, 0.0224)), (90, (4.2e-3, 0.0767))], (90, (4.2e-3, 0.0767))),
)
def test_multiple_scales_fit_of_large_decay_is_biased(degrees, bias):
    """The numbers are those in docs/multiple-scales.md."""
    exact, errors, formula = both_fits(degrees)
    assert np.all(np.abs(exact - [OMEGA_N, ZETA]) < 3 * errors)
    np.testing.assert_allclose(formula / exact - 1, bias, rtol=0.1)


def test_piecewise_trajectory_joins_both_cases():
    numbers = [OMEGA_N, ZETA, 0.6, 0.7]
    slopes, (found, position) = piecewise(jnp.array(numbers))
    expected, times, speeds = literal_chain(0.7, 0.6, FINE, 4)
    np.testing.assert_allclose(found.impact_time, times, rtol=1e-12)
    np.testing.assert_allclose(found.approach_speed, LENGTH * speeds, rtol=1e-12)
    np.testing.assert_allclose(found.separation_speed, 0.6 * LENGTH * speeds, rtol=1e-12)
    np.testing.assert_allclose(position, expected, atol=1e-12)
    assert np.isnan(expected).any()

    for index in range(4):

        def moved(x, index=index):
            omega, zeta, r, theta0 = [*numbers[:index], x, *numbers[index + 1 :]]
            out, times, _ = literal_chain(theta0, r, FINE[:EARLY], 4, omega, zeta)
            return np.append(out, times[-1])

        by_hand = richardson(moved, numbers[index], 1e-3 * numbers[index])
        np.testing.assert_allclose(slopes[:, index], by_hand, atol=1e-8 * np.abs(by_hand).max())


def test_piecewise_trajectory_from_any_state_and_after_the_last_impact():
    found = ij.piecewise_analytical(
        PENDULUM, ij.LinearRestitution(0.7, 0.2), ij.InitialState(0.3, 5.0), max_impacts=3
    )
    first = ij.MultipleScales(PENDULUM, ij.InitialState(0.3, 5.0))
    begin = float(found.impact_time[0])
    assert abs(float(first.position(begin))) < 1e-15
    assert float(found.position(0.1)) == pytest.approx(float(first.position(0.1)))
    after = float(found.velocity(begin))
    r = 0.7 - 0.2 * float(found.approach_speed[0])
    assert after == pytest.approx(-r * float(first.velocity(begin)), rel=1e-14)
    assert np.isnan(found.position(float(found.impact_time[-1])))
    outside = ij.piecewise_analytical(
        PENDULUM, ij.LinearRestitution(0.5, 2.0), ij.InitialState(0.7), max_impacts=2
    )
    assert np.isfinite(outside.impact_time[0])
    assert np.isnan(outside.impact_time[1])


def test_multiple_scales_refuses_wrong_arguments():
    shaken = ij.Pendulum(OMEGA_N, base=ij.HarmonicMotion(0.001, 10.0))
    for wrong in (shaken, ij.Pendulum(OMEGA_N, dry_friction=0.1)):
        with pytest.raises(ValueError, match="neither dry friction nor a moving base"):
            ij.MultipleScales(wrong, ij.InitialState(0.5))
    with pytest.raises(ValueError, match="`max_impacts` must be at least 1"):
        ij.piecewise_analytical(PENDULUM, ij.Restitution(0.5), ij.InitialState(0.5), max_impacts=0)
