"""Motions of the base that have been measured, against SciPy begun anew at each knot and impact."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import impactjax as ij
from pendulum_on_base import LENGTH, OMEGA, START, ZETA, R, motion
from tiers import quick

KNOTS = np.linspace(0.0, 1.5, 46)
SHAKE = 3 * np.sin(18 * KNOTS) + 2 * np.cos(31 * KNOTS + 0.3) - 1.5 * np.sin(44 * KNOTS)
TS = np.linspace(0.0, 1.5, 31)


def model(base, omega_n=OMEGA, r=R):
    pendulum = ij.Pendulum(omega_n, ZETA, length=LENGTH, base=base)
    return ij.ImpactOscillator(pendulum, ij.Stop(ij.Restitution(r)))


def run(base, **settings):
    return ij.simulate(model(base), ij.InitialState(START), TS, tolerance=1e-12, **settings)


@pytest.fixture(scope="module")
def base():
    return ij.MeasuredMotion(KNOTS, SHAKE)


@pytest.fixture(scope="module")
def in_scipy():
    return motion(CubicSpline(KNOTS, SHAKE), TS, KNOTS, 1e-12)


@pytest.mark.parametrize("step", [None, ij.RungeKutta()], ids=["taylor", "runge-kutta"])
def test_motion_on_a_measured_base_is_that_of_scipy(base, in_scipy, step):
    found, (angles, impacts) = run(base, step=step), in_scipy
    assert found.result == ij.RESULTS.successful
    assert int(found.impacts.count) == impacts > 3
    np.testing.assert_allclose(found.position, angles, rtol=0, atol=1e-10)


def test_oscillator_as_a_mechanism_moves_on_a_measured_base(base, in_scipy):
    system = ij.MechanicalSystem(ij.OscillatorMechanism(model(base)))
    solution = ij.solve(system, system.start(0.0, [0.5], [0.0]), TS, tolerance=1e-12)
    assert solution.result == ij.RESULTS.successful
    np.testing.assert_allclose(solution.ys.q[:, 0], in_scipy[0], rtol=0, atol=1e-10)


def test_derivatives_on_a_measured_base_are_those_of_differences(base):
    def angle(parameters):
        omega, r = parameters
        return ij.simulate(
            model(base, omega, r), ij.InitialState(START), TS, tolerance=1e-13
        ).position

    at, way, small = jnp.array([OMEGA, R]), jnp.array([1.0, 0.1]), 1e-5
    forward = jax.jit(lambda x: jax.jvp(angle, (x,), (way,)))(at)[1]
    difference = (angle(at + small * way) - angle(at - small * way)) / (2 * small)
    np.testing.assert_allclose(forward, difference, rtol=0, atol=1e-6 * np.ptp(forward))
    _, back = jax.vjp(angle, at)
    weights = jnp.cos(jnp.arange(len(TS)))
    np.testing.assert_allclose(weights @ forward, back(weights)[0] @ way, rtol=1e-11)


def test_run_beyond_the_measurement_ends():
    short = ij.MeasuredMotion(KNOTS[:31], SHAKE[:31])
    found = run(short)
    assert found.result == ij.RESULTS.non_finite
    known = KNOTS[30] >= TS
    assert np.isfinite(found.position[known]).all()
    assert np.isnan(found.position[~known]).all()
    late = ij.MeasuredMotion(KNOTS + 0.01, SHAKE)
    assert run(late).result == ij.RESULTS.non_finite


def test_inertia_is_minus_the_spline(base):
    times = np.linspace(0.0, 1.5, 97)
    expected = -CubicSpline(KNOTS, SHAKE)(times)
    np.testing.assert_allclose(base.inertia(jnp.asarray(times)), expected, rtol=0, atol=1e-12)


def test_displacement_tells_the_acceleration():
    times, rng = np.linspace(0.0, 1.0, 501), np.random.default_rng(2)
    place = 2e-3 * np.sin(40 * times) + 1e-6 * rng.standard_normal(times.size)
    base = ij.MeasuredMotion.of_displacement(times, place)
    inner = times[50:-50]
    expected = 2e-3 * 40**2 * np.sin(40 * inner)
    error = np.std(base.inertia(jnp.asarray(inner)) - expected)
    differences = np.diff(place, 2) / np.diff(times)[0] ** 2
    of_differences = np.std(differences + 2e-3 * 40**2 * np.sin(40 * times[1:-1]))
    assert error < of_differences / 5
    assert error < 0.05 * np.std(expected)


@quick
@pytest.mark.parametrize(
    ("times", "values", "said"),
    [
        (KNOTS[:4], SHAKE[:4], "at least 5 samples, but there are 4"),
        (KNOTS, SHAKE[:-1], r"their shapes are \(46,\) and \(45,\)"),
        (KNOTS[::-1], SHAKE, "must increase strictly"),
        (KNOTS, np.where(KNOTS > 1, np.nan, SHAKE), "must be finite"),
    ],
)
def test_wrong_measurement_is_refused(times, values, said):
    with pytest.raises(ValueError, match=said):
        ij.MeasuredMotion(times, values)


@quick
def test_measurement_must_be_known():
    with pytest.raises(ValueError, match="must be known while a program is traced"):
        jax.jit(lambda values: ij.MeasuredMotion(KNOTS, values).times)(jnp.asarray(SHAKE))


class Pushed(ij.HybridSystem):
    """x′ = p(t), with p = t up to 1 and p = 3 − t from there on."""

    def flow(self, t, y, mode):
        return jnp.where(ij.held(t) < 1, t, 3 - t)

    def smooth_until(self, t, mode):
        return jnp.where(t < 1, 1.0, jnp.inf)

    def transitions(self):
        return []


def test_step_of_a_hybrid_system_ends_where_its_flow_is_not_smooth():
    ts = np.linspace(0.0, 2.0, 9)
    found = ij.solve(Pushed(), ij.Start(0.0, 0.0), ts, step=ij.TaylorStep(8))
    expected = np.where(ts < 1, ts**2 / 2, 0.5 + 3 * (ts - 1) - (ts**2 - 1) / 2)
    np.testing.assert_allclose(found.ys, expected, rtol=1e-14)
