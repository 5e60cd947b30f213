"""First look at a recording: estimates near the truth, and never out of range."""

import math

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import impactjax as ij
from impactjax._compare.laws import LAWS
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._first_look.coordinate import from_velocity
from reference import ball, pendulum, simulate_rigid, spring
from tiers import thorough

DEGREE = math.pi / 180

TS = np.linspace(0.0, 2.0, 2001)
NOISE = np.random.default_rng(5).standard_normal(2001)


def seen(values, quantity, oscillator, ts=TS):
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(values), quantity)
    return recording.first_look(oscillator)


@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize(("omega", "zeta"), [(10.0, 0.01), (20.0, 0.1), (30.0, 0.002)])
def test_first_look_at_free_swing(omega, zeta, noise):
    root = omega * math.sqrt(1 - zeta**2)
    values = 0.2 * np.exp(-zeta * omega * TS) * np.cos(root * TS) + noise * NOISE
    found = seen(values, ij.Displacement(), ij.LinearOscillator(1.0))
    assert found.swings_freely
    assert isinstance(found.oscillator, ij.LinearOscillator)
    assert float(found.oscillator.omega_n) == pytest.approx(omega, rel=0.02)
    assert float(found.oscillator.zeta) == pytest.approx(zeta, rel=0.2, abs=4e-3)
    assert float(found.initial.position) == pytest.approx(0.2, abs=4 * noise + 1e-3)


@pytest.mark.parametrize(
    "quantity", [ij.ContactForce(), ij.ProperAcceleration(), ij.Acceleration()]
)
@pytest.mark.parametrize("duration", [0.01, 0.02, 0.05])
def test_first_look_at_contact_duration(duration, quantity):
    """Half sines, each lower than the one before."""
    values = np.zeros_like(TS)
    for begin, height in ((0.2, 900.0), (0.9, 700.0), (1.5, 500.0)):
        touches = (begin < TS) & (begin + duration > TS)
        values += touches * height * np.sin(np.pi * (TS - begin) / duration)
    found = seen(values + NOISE, quantity, ij.BouncingBall())
    assert found.contact_frequency == pytest.approx(np.pi / duration, rel=0.2)


def test_nonpositive_force_shows_no_contact():
    found = seen(np.minimum(NOISE, 0.0), ij.ContactForce(), ij.BouncingBall())
    assert found.contact_frequency == pytest.approx(np.pi / 0.004)


@pytest.mark.parametrize("noise", [0.0, 3e-3])
@pytest.mark.parametrize("r", [0.4, 0.6, 0.9])
def test_first_look_at_impacting_pendulum(r, noise):
    omega = 13.47
    run = simulate_rigid(pendulum(omega), [45 * DEGREE, 0.0], TS[:1401], lambda speed: r)
    values = run.position + noise * NOISE[:1401]
    found = seen(values, ij.Angle(), ij.Pendulum(1.0, length=0.07), TS[:1401])
    assert not found.swings_freely
    assert isinstance(found.oscillator, ij.Pendulum)
    assert float(found.oscillator.omega_n) == pytest.approx(omega, rel=0.03)
    assert found.restitution == pytest.approx(r, abs=0.05)
    assert found.speeds[0] == pytest.approx(0.07 * run.approach[0], rel=0.05)


def with_gap(gap, r, omega=25.0):
    """A spring-mass system whose stop is at −gap, from 30 mm, by SciPy."""
    run = simulate_rigid(spring(omega, gap), [0.03 + gap, 0.0], TS[:1401], lambda speed: r)
    return run, run.position - gap


@pytest.mark.parametrize("noise", [0.0, 1e-4])
@pytest.mark.parametrize(("gap", "r"), [(0.0, 0.65), (0.004, 0.65), (0.008, 0.65), (-0.001, 0.9)])
def test_first_look_with_gap(gap, r, noise):
    """Flights take longer or shorter, and turns that do not reach the stop are no impacts."""
    run, position = with_gap(gap, r)
    values = position + noise * NOISE[:1401]
    recording = ij.Recording(jnp.asarray(TS[:1401]), jnp.asarray(values), ij.Displacement())
    found = recording.first_look(ij.LinearOscillator(1.0), gap)
    assert not found.swings_freely
    assert found.elsewhere is None
    assert isinstance(found.oscillator, ij.LinearOscillator)
    assert float(found.oscillator.omega_n) == pytest.approx(25.0, rel=0.02)
    assert found.restitution == pytest.approx(r, abs=0.05)
    assert found.speeds[0] == pytest.approx(run.approach[0], rel=0.05)
    assert found.marks.size <= run.approach.size
    np.testing.assert_allclose(found.marks, run.impact_times[: found.marks.size], atol=1e-2)


@pytest.mark.parametrize(("gap", "r"), [(0.004, 0.65), (0.008, 0.65), (-0.004, 0.9)])
def test_first_look_detects_displaced_stop(gap, r):
    _, position = with_gap(gap, r)
    found = seen(
        position + 1e-4 * NOISE[:1401], ij.Displacement(), ij.LinearOscillator(1.0), TS[:1401]
    )
    assert found.elsewhere == pytest.approx(-gap, abs=4e-4)


def test_first_look_at_impact_times():
    r, speed, gravity = 0.8, 1.5, 9.80665
    times = 2 * speed / gravity * (1 - r ** np.arange(9)) / (1 - r)
    found = ij.ImpactTimes(jnp.asarray(times)).first_look(ij.BouncingBall())
    assert found.restitution == pytest.approx(r, rel=1e-9)
    assert found.restitution_line == pytest.approx((r, 0.0), abs=1e-9)
    assert float(found.initial.velocity) == pytest.approx(speed, rel=1e-9)
    with pytest.raises(ValueError, match="needs a bouncing ball"):
        ij.ImpactTimes(jnp.asarray(times)).first_look(ij.FreeMass())


SHAPES = st.sampled_from([np.cumsum, np.sort, np.abs, np.asarray, np.round])


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(2, 60),
    size=st.floats(1e-6, 1e3),
    shape=SHAPES,
    oscillator=st.sampled_from(["pendulum", "linear-oscillator", "bouncing-ball", "free-mass"]),
    gap=st.floats(-1, 1),
)
@example(1415, 13, 3.0, np.cumsum, "pendulum", 1.0)  # impacts of one speed
@example(1415, 12, 1.0, np.cumsum, "pendulum", 0.0)  # flights that stay below the stop
@example(1151296, 2, 1.0, np.round, "pendulum", 0.0)  # a quantised record that begins at rest
def test_first_look_values_are_in_range(seed, count, size, shape, oscillator, gap):
    generator = np.random.default_rng(seed)
    ts = np.cumsum(generator.uniform(1e-3, 1e-2, count))
    moving = OSCILLATORS[oscillator]()
    quantity = ij.Angle() if moving.is_angle() else ij.Displacement()
    values = size * shape(generator.standard_normal(count))
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(values), quantity)
    found = recording.first_look(moving, gap)
    assert np.all(np.isfinite(found.speeds))
    assert np.all(np.isfinite([found.initial.position, found.initial.velocity]))
    for law in LAWS.values():
        ij.ImpactOscillator(found.oscillator, ij.Stop(law(found)))  # raises out of range


@thorough
@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 20))
def test_first_look_values_of_impact_times_are_in_range(seed, count):
    times = np.cumsum(np.random.default_rng(seed).uniform(1e-6, 1, count))
    found = ij.ImpactTimes(jnp.asarray(times)).first_look(ij.BouncingBall())
    for law in LAWS.values():
        ij.ImpactOscillator(found.oscillator, ij.Stop(law(found)))


def test_first_look_keeps_other_oscillator_parameters():
    base = ij.HarmonicMotion(0.01, 3.0)
    pendulum = ij.Pendulum(10.0, 0.01, base=base, equilibrium=ij.Inverted(), length=0.3)
    values = 0.3 * np.cos(12 * TS)
    found = seen(values, ij.Angle(), pendulum).oscillator
    assert isinstance(found, ij.Pendulum)
    assert abs(float(found.omega_n) / 12 - 1) < 0.05
    assert isinstance(found.base, ij.HarmonicMotion)
    assert (float(found.base.amplitude), float(found.base.frequency)) == (0.01, 3.0)
    assert isinstance(found.equilibrium, ij.Inverted)
    assert found.length is pendulum.length


def test_first_look_figure_shows_detected_impacts():
    ts = TS[:1001]
    flights = simulate_rigid(ball(), [0.2, 0.0], ts, lambda speed: 0.8).position
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(2 * flights + 0.5), ij.Displacement())
    known = {"gain": 2.0, "offset": 0.5}
    prepared = ij.prepare(recording, oscillator=ij.BouncingBall(), laws=["none"], fixed=known)
    look = prepared.first_look
    assert 3 <= len(look.marks) <= 20
    ax = plt.figure().add_subplot()
    ij.plot.first_look(ax, prepared.experiment.recording, look)
    marks = np.asarray(ax.get_lines()[1].get_xdata())
    np.testing.assert_array_equal(marks, look.marks)


def test_single_wrong_samples_hide_no_impact_of_a_velocity():
    """Flights of 0.25 s between contacts of five samples."""
    ts = np.linspace(0.0, 1.0, 1001)
    rates = np.convolve(1 - 2 * (4 * ts % 1), np.full(5, 0.2), mode="same")
    rates[[130, 610]] -= 0.3
    places = from_velocity(ts, rates)
    assert places.min() > -0.05 * places.max()
    assert places.max() == pytest.approx(0.25 / 4, rel=0.05)


@pytest.mark.parametrize("bias", [-0.6, 0.6])
def test_zero_of_a_velocity_hides_no_impact(bias):
    """A bias of the size of the slower impacts; impact speeds are 2.8, 2, 1.4 m/s and so on."""
    ts = TS[:1401]
    motion = simulate_rigid(ball(), [0.4, 0.0], ts, lambda speed: 0.7)
    look = seen(motion.velocity + bias, ij.Velocity(), ij.BouncingBall(), ts)
    expected = motion.impact_times[motion.impact_times < 1.2]
    np.testing.assert_allclose(look.marks[: expected.size], expected, atol=0.01)
    assert not look.swings_freely
