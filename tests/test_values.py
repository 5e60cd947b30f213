"""Simulated values against closed forms and against SciPy restarted at each event."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from laws import LAWS
from reference import ball_impact_time, ball_position, pendulum, simulate_compliant, simulate_rigid
from systems import STEPS
from tiers import mostly_thorough, thorough

OMEGA_N, ZETA = 13.47, 0.0017
OMEGA0, GAMMA = LAWS["kelvin-voigt"].values
TIMES = np.linspace(0.0, 1.4, 281)
RELEASED = ij.InitialState(math.pi / 4)
TOLERANCES = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12]


free_pendulum = pendulum(OMEGA_N, ZETA)


def touching_pendulum(t, y):
    contact = -2 * GAMMA * OMEGA0 * y[1] - OMEGA0**2 * y[0]
    return free_pendulum(t, y) + np.array([0.0, contact])


@functools.cache
def reference(law: str):
    start = [math.pi / 4, 0.0]
    if law == "kelvin-voigt":
        return simulate_compliant(free_pendulum, touching_pendulum, start, TIMES)
    r0, alpha = (*LAWS[law].values, 0.0)[:2]
    return simulate_rigid(free_pendulum, start, TIMES, lambda v: r0 - alpha * 0.071 * v)


PENDULUM = ij.Pendulum(OMEGA_N, ZETA, length=0.071)
SIMULATED = ("restitution", "linear-restitution", "kelvin-voigt")


@pytest.mark.parametrize("step", mostly_thorough(STEPS, "Taylor", "Dopri8"))
@pytest.mark.parametrize("law", mostly_thorough(SIMULATED, "kelvin-voigt"))
def test_pendulum_is_within_ten_tolerances_of_scipy(law, step):
    model = ij.ImpactOscillator(PENDULUM, ij.Stop(LAWS[law].law))
    known = reference(law)
    impacts = len(known.impact_times)
    for tolerance in TOLERANCES if step != "Tsit5" else TOLERANCES[:4]:
        found = ij.simulate(
            model, RELEASED, TIMES, step=STEPS[step], tolerance=tolerance, max_steps=2048
        )
        assert found.result == ij.RESULTS.successful
        assert found.impacts.count == impacts
        scale = math.pi / 4
        assert np.max(np.abs(found.position - known.position)) < 10 * tolerance * scale
        assert np.max(np.abs(found.velocity - known.velocity)) < 10 * tolerance * scale * OMEGA0
        times = found.impacts.time[:impacts]
        assert np.max(np.abs(times - known.impact_times)) < 10 * tolerance * TIMES[-1]
        approach = found.impacts.approach_speed[:impacts] / 0.071
        np.testing.assert_allclose(approach, known.approach, rtol=10 * tolerance)
        left = len(known.separation)
        separation = found.impacts.separation_speed[:left] / 0.071
        np.testing.assert_allclose(separation, known.separation, rtol=10 * tolerance)


@pytest.mark.parametrize("step", mostly_thorough(STEPS, "Taylor", "Dopri8"))
def test_ball_is_exact(step):
    height, gravity, r = 0.2, 9.81, 0.9
    model = ij.ImpactOscillator(ij.BouncingBall(gravity), ij.Stop(ij.Restitution(r)))
    ts = np.linspace(0.0, 1.6, 161)
    found = ij.simulate(model, ij.InitialState(height), ts, step=STEPS[step], tolerance=1e-12)
    times = [float(ball_impact_time(height, gravity, r, k)) for k in range(8)]
    counts = np.searchsorted(times, ts, side="right")
    expected = [
        float(ball_position(height, gravity, r, t, n)) for t, n in zip(ts, counts, strict=True)
    ]
    np.testing.assert_allclose(found.position, expected, atol=1e-11 * height)
    count = int(found.impacts.count)
    np.testing.assert_allclose(found.impacts.time[:count], times[:count], rtol=1e-12)


@pytest.mark.parametrize("step", mostly_thorough(STEPS, "Taylor", "Dopri8"))
@pytest.mark.parametrize("gamma", mostly_thorough([0.0, 0.05, 0.18, 0.7], 0.0, 0.18))
def test_free_mass_on_kelvin_voigt_rebounds_by_the_closed_form(gamma, step):
    model = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.KelvinVoigt(OMEGA0, gamma)))
    root = math.sqrt(1 - gamma**2)
    r, duration = math.exp(-math.pi * gamma / root), math.pi / (OMEGA0 * root)
    for tolerance in TOLERANCES if step != "Tsit5" else TOLERANCES[:4]:
        run = ij.simulate(
            model,
            ij.InitialState(0.1, -1.0),
            np.linspace(0.0, 0.2, 11),
            step=STEPS[step],
            tolerance=tolerance,
        )
        assert run.result == ij.RESULTS.successful
        assert abs(float(run.impacts.restitution[0]) - r) < 10 * tolerance * r
        assert abs(float(run.impacts.duration[0]) - duration) < 10 * tolerance * duration
        assert abs(float(run.impacts.energy_lost[0]) - (1 - r**2) / 2) < 10 * tolerance


@thorough
def test_kelvin_voigt_that_never_pulls_leaves_where_the_force_is_zero():
    model = ij.ImpactOscillator(
        ij.FreeMass(), ij.Stop(ij.KelvinVoigt(OMEGA0, GAMMA, separation=ij.AtZeroForce()))
    )
    run = ij.simulate(model, ij.InitialState(0.1, -1.0), np.linspace(0.0, 0.2, 11), tolerance=1e-12)
    # Schwager & Poeschel (2007): the contact ends at omega_d t = pi - arctan(...), sooner than
    # at zero penetration.
    root = math.sqrt(1 - GAMMA**2)
    end = math.pi - math.atan2(2 * GAMMA * root, 2 * GAMMA**2 - 1) + math.pi
    phase = math.atan2(2 * GAMMA * root, 1 - 2 * GAMMA**2)
    end = math.pi - phase
    tau = end / root
    r = -math.exp(-GAMMA * tau) * (math.cos(end) - GAMMA / root * math.sin(end))
    assert abs(float(run.impacts.duration[0]) * OMEGA0 - tau) < 1e-10
    assert abs(float(run.impacts.restitution[0]) - r) < 1e-11


def test_dry_friction_sticking_in_closed_form():
    # x'' + w^2 x + f sgn x' = 0: each half swing loses 2 f / w^2; it sticks inside f / w^2.
    omega, friction, start = 5.0, 3.0, 1.0
    model = ij.ImpactOscillator(ij.LinearOscillator(omega, dry_friction=friction))
    run = ij.simulate(model, ij.InitialState(start), np.linspace(0, 10, 101), tolerance=1e-12)
    extreme, loss, swings = start, 2 * friction / omega**2, 0
    while abs(extreme) > friction / omega**2:
        extreme = -(extreme - math.copysign(loss, extreme))
        swings += 1
    assert run.result == ij.RESULTS.successful
    np.testing.assert_allclose(run.position[-1], extreme, atol=1e-11)
    assert run.velocity[-1] == 0
    after = math.pi / omega * swings
    assert np.all(np.asarray(run.velocity)[np.linspace(0, 10, 101) > after] == 0)


def test_elastic_impacts_keep_the_energy():
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(1.0)))
    gravity = float(ij.BouncingBall().gravity)
    run = ij.simulate(
        model,
        ij.InitialState(0.1),
        np.linspace(0.0, 286.0, 11),
        max_impacts=1024,
        max_steps=2048,
    )
    assert run.result == ij.RESULTS.successful
    assert run.impacts.count > 1000
    energy = np.asarray(run.velocity) ** 2 / 2 + gravity * np.asarray(run.position)
    np.testing.assert_allclose(energy, gravity * 0.1, rtol=1e-10)


def test_values_cause_no_retrace():
    traces = []

    @jax.jit
    def position(omega_n, r, theta0, tolerance):
        traces.append(1)
        model = ij.ImpactOscillator(ij.Pendulum(omega_n), ij.Stop(ij.Restitution(r)))
        return ij.simulate(model, ij.InitialState(theta0), TIMES, tolerance=tolerance).position

    for i in range(3):
        position(13.0 + i, 0.5 + 0.1 * i, 0.3, 10.0 ** -(6 + i))
    assert len(traces) == 1


@pytest.mark.parametrize("step", [ij.TaylorStep(), ij.RungeKutta()], ids=["taylor", "runge-kutta"])
def test_start_on_stop_moving_inwards_is_an_impact(step):
    """Thrown up against a ceiling that it touches, a ball comes back with r times its speed."""
    ceiling = ij.Stop(ij.Restitution(0.5), 0.5)
    model = ij.ImpactOscillator(ij.BouncingBall(), upper=ceiling)
    run = ij.simulate(model, ij.InitialState(0.5, 1.0), np.linspace(0.0, 0.1, 3), step=step)
    t = np.linspace(0.0, 0.1, 3)
    np.testing.assert_allclose(run.position, 0.5 - 0.5 * t - 9.80665 / 2 * t**2, atol=1e-9)
    assert run.impacts.count == 1


@thorough
def test_inverted_pendulum_is_shifted_hanging_one():
    standing = ij.Pendulum(5.0, 0.1, equilibrium=ij.Inverted())
    times = jnp.linspace(0.0, 2.0, 41)
    ours, turned = (
        ij.simulate(
            ij.ImpactOscillator(oscillator), ij.InitialState(angle, 0.3), times, tolerance=1e-12
        )
        for oscillator, angle in ((standing, 0.2), (ij.Pendulum(5.0, 0.1), 0.2 + np.pi))
    )
    np.testing.assert_allclose(ours.position, turned.position - np.pi, atol=1e-10)
    assert np.max(np.abs(ours.position)) > 1
