"""Observed quantities against closed forms and differences of the motion."""

import math

import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import mostly_thorough

TS = np.linspace(0.0, 0.6, 6001)
GRAVITY = 9.81
OMEGA0, GAMMA, MASS = 200.0, 0.1, 0.5
BALL = ij.ImpactOscillator(
    ij.BouncingBall(GRAVITY, mass=MASS, drag=0.05), ij.Stop(ij.KelvinVoigt(OMEGA0, GAMMA))
)
DROP = ij.simulate(BALL, ij.InitialState(0.3), TS)


def shown(quantity, model=BALL, run=DROP):
    return np.asarray(quantity.value(model, run))


def in_contact():
    return np.asarray(DROP.position) < 0


def test_acceleration_is_derivative_of_velocity():
    slope = np.gradient(np.asarray(DROP.velocity), TS)
    smooth = np.abs(np.diff(in_contact(), prepend=False, append=False).astype(int))
    away = np.convolve(smooth, np.ones(5))[2:-3] == 0
    np.testing.assert_allclose(shown(ij.Acceleration())[away][1:-1], slope[away][1:-1], atol=0.2)
    assert np.ptp(slope) > 400
    np.testing.assert_array_equal(shown(ij.Velocity()), DROP.velocity)


def test_contact_force_of_spring_and_dashpot():
    depth, rate = -np.asarray(DROP.position), -np.asarray(DROP.velocity)
    force = MASS * (OMEGA0**2 * depth + 2 * GAMMA * OMEGA0 * rate)
    np.testing.assert_allclose(
        shown(ij.ContactForce()), np.where(in_contact(), force, 0), rtol=1e-9, atol=1e-12
    )


def test_proper_acceleration_excludes_gravity():
    felt = shown(ij.ProperAcceleration())
    np.testing.assert_allclose(felt, shown(ij.Acceleration()) + GRAVITY, atol=1e-12)
    falls = TS < 0.2
    drag = 0.05 * np.asarray(DROP.velocity)[falls] ** 2
    np.testing.assert_allclose(felt[falls], drag, rtol=1e-9, atol=1e-12)


def test_rigid_stop_carries_resting_mass():
    model = ij.ImpactOscillator(ij.BouncingBall(GRAVITY, mass=MASS), ij.Stop(ij.Restitution(0.3)))
    run = ij.simulate(model, ij.InitialState(0.05), TS)
    end = 0.1010 * (1 + 2 * 0.3 / 0.7)  # √(2 h / g) and the series of flights
    for quantity, free, rests in (
        (ij.ContactForce(), 0.0, MASS * GRAVITY),
        (ij.ProperAcceleration(), 0.0, GRAVITY),
        (ij.Acceleration(), -GRAVITY, 0.0),
    ):
        found = shown(quantity, model, run)
        np.testing.assert_allclose(found[end - 0.01 > TS], free, atol=1e-12)
        np.testing.assert_allclose(found[end + 0.01 < TS], rests, rtol=1e-12)


def test_held_pendulum_has_no_acceleration():
    model = ij.ImpactOscillator(ij.Pendulum(10.0, 0.0, length=0.1, dry_friction=30.0))
    run = ij.simulate(model, ij.InitialState(0.25), np.linspace(0.0, 1.0, 11))
    np.testing.assert_array_equal(shown(ij.AngularAcceleration(), model, run), 0)
    np.testing.assert_array_equal(shown(ij.AngularVelocity(), model, run), 0)


def test_force_record_refuses_law_with_internal_state():
    model = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Maxwell(100.0, 0.1)))
    with pytest.raises(ValueError, match="force of Maxwell depends on more"):
        shown(ij.ContactForce(), model)


QUANTITIES = [ij.Velocity(), ij.ProperAcceleration(), ij.ContactForce()]


@pytest.mark.parametrize(
    "quantity", mostly_thorough(QUANTITIES, QUANTITIES[1]), ids=lambda q: q.name
)
def test_bouncing_ball_is_fitted_without_displacement(quantity):
    """The truth comes back from exact values, with no guess."""
    truth = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.KelvinVoigt(300.0, 0.1)))
    ts = jnp.linspace(0.0, 0.8, 801)
    run = ij.simulate(truth, ij.InitialState(0.2), ts)
    values = quantity.value(truth, run)
    noise = 1e-4 * float(jnp.ptp(values)) * np.random.default_rng(2).standard_normal(801)
    recording = ij.Recording(ts, values + noise, quantity)
    ball, known = ij.BouncingBall(), {"x_dot0": 0.0}
    prepared = ij.prepare(recording, oscillator=ball, laws=["kelvin-voigt"], fixed=known)
    found = ij.fit(prepared.experiments["kelvin-voigt"])
    for name, value in (("omega0", 300.0), ("gamma", 0.1), ("x0", 0.2)):
        assert found.value(name) == pytest.approx(value, rel=0.01), name
        assert found.verdict(name) is ij.Verdict.IDENTIFIED


def test_units_of_acceleration_and_velocity(tmp_path):
    path = tmp_path / "r.csv"
    for header, factor, kind in (
        ("proper acceleration [g]", 9.80665, ij.ProperAcceleration),
        ("Acceleration (m/s^2)", 1.0, ij.Acceleration),
        ("angular velocity [deg/s]", math.pi / 180, ij.AngularVelocity),
        ("contact force [mN]", 1e-3, ij.ContactForce),
    ):
        path.write_text(f"time [s], {header}\n0, 1\n1, 3\n")
        found = ij.io.read_recording(path).recording
        assert isinstance(found, ij.Recording)
        assert isinstance(found.quantity, kind)
        np.testing.assert_allclose(found.values, np.array([1, 3]) * factor, rtol=1e-15)
