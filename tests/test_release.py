"""When a hand lets go: found within a few hundredths of a second, and never invented."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate

import impactjax as ij
from reference import ball, pendulum, simulate_rigid
from tiers import quick

pytestmark = quick

DEGREE = math.pi / 180
OMEGA = 12.0


def fall(ts, y0, zeta=0.01, friction=0.0):
    """A free pendulum by SciPy."""

    def flow(t, y):
        loss = 2 * zeta * OMEGA * y[1] + friction * np.tanh(y[1] / 1e-3)
        return [y[1], -(OMEGA**2) * np.sin(y[0]) - loss]

    found = integrate.solve_ivp(flow, (0, ts[-1]), y0, t_eval=ts, rtol=1e-8, atol=1e-10)
    return found.y[0]


def bouncing(ts, y0):
    return simulate_rigid(pendulum(OMEGA), y0, ts, lambda speed: 0.6).position


def found(
    ts: np.ndarray,
    values: np.ndarray,
    noise: float,
    oscillator: ij.AbstractOscillator | None = None,
    quantity: ij.AbstractQuantity = ij.Angle(),
) -> float | None:
    noisy = values + noise * np.random.default_rng(8).standard_normal(len(ts))
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(noisy), quantity)
    look = recording.first_look(oscillator or ij.Pendulum(10.0, length=0.07))
    free = recording.free_part(look)
    assert free is None or free.end == pytest.approx(ts[-1])
    return None if free is None else free.begin


@pytest.mark.parametrize("held", [0.1, 0.2, 0.3])
def test_release_is_found_beside_outliers_that_are_left_out(held):
    """One sample in a hundred does not count; a hand holds, then the mass falls and bounces."""
    ts, random = np.arange(1401) / 1000, np.random.default_rng(3)
    hand = round(1000 * held)
    angle = np.concatenate([np.full(hand, 0.785), bouncing(ts, [0.785, 0.0])])[: len(ts)]
    noisy = angle + 0.2 * DEGREE * random.standard_normal(len(ts))
    valid = random.random(len(ts)) > 0.01
    recording = ij.Recording(ts, noisy, ij.Angle(), valid)
    free = recording.free_part(recording.first_look(ij.Pendulum(10.0, length=0.07)))
    assert free is not None
    assert held - 0.03 < free.begin < held + 0.25


NOISES = [0.02 * DEGREE, 0.2 * DEGREE]
TS = np.arange(3000) / 1000


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("held", [0.15, 0.4, 0.8])
@pytest.mark.parametrize("moved", [0.0, 0.5])
def test_released_swing_is_free_from_first_turn(held, moved, noise):
    """A hand that holds still, or lifts at half a radian a second."""
    count = int(1000 * held)
    start = 1.0 - moved * (held - TS[:count])
    values = np.concatenate([start, fall(TS[: 3000 - count], [1.0, moved])])
    time = found(TS, values, noise)
    turn = held + math.pi / OMEGA * 1.07
    assert time is not None
    assert held < time < turn + 0.05


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("held", [0.15, 0.4])
def test_released_fall_is_free_soon_after(held, noise):
    count = int(1000 * held)
    ts = TS[:1600]
    values = np.concatenate([np.full(count, 0.8), bouncing(ts[: 1600 - count], [0.8, 0.0])])
    time = found(ts, values, noise)
    assert time is not None
    assert held <= time < held + 0.12


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("friction", [0.0, 2.0])
@pytest.mark.parametrize("first", [[1.0, 0.0], [0.2, 0.0], [2.5, 1.0], [-1.0, -5.0]])
def test_free_swing_is_not_cut(first, friction, noise):
    assert found(TS, fall(TS, first, friction=friction), noise) is None


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("first", [[0.8, 0.0], [0.3, 0.0], [0.8, 4.0], [1.4, -2.0]])
def test_free_fall_is_not_cut(first, noise):
    assert found(TS[:1400], bouncing(TS[:1400], first), noise) is None


def test_accelerometer_fall_and_landing():
    ts = np.arange(800) / 200
    felt = np.where(ts < 2.0, 9.8, np.where(ts < 2.6, 0.3, 9.8))
    felt[520:530], felt[530:540] = 150.0, 1.0
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(felt), ij.ProperAcceleration())
    free = recording.free_part(recording.first_look(ij.BouncingBall()))
    assert free is not None
    assert (free.begin, free.end) == pytest.approx((2.0, 2.65 + 0.055))
    assert free.at_rest
    falling = recording.between(2.0, 2.706)
    assert falling.free_part(falling.first_look(ij.BouncingBall())) is None
    assert falling.ts.shape == (142,)


def test_dropped_accelerometer_was_let_go_within_a_sample():
    rate, landing = 200.0, 130
    ts = np.arange(200) / rate
    felt = np.where(ts < 0.2, 9.8, 0.0)
    felt[landing : landing + 5] = 150.0
    recording = ij.Recording(ts, felt, ij.ProperAcceleration())
    own = ij.prepare(recording, laws=["restitution"]).experiment
    assert "x_dot0" not in own.fixed
    speed = own.priors["x_dot0"]
    assert (speed.mean, speed.sigma) == pytest.approx((0.0, 9.80665 / rate))
    thrown = {"x_dot0": ij.Normal(-0.7, 0.1)}
    stated = ij.prepare(recording, laws=["restitution"], priors=thrown).experiment
    assert stated.priors == thrown


@pytest.mark.parametrize("held", [0.2, 0.4])
def test_release_of_ball_without_long_flights(held):
    """Its gravity is known, so that a hand shows without another flight to compare with."""
    ts = np.arange(int(240 * (held + 0.8))) / 240
    below = ts < held
    falls = simulate_rigid(ball(), [0.3, 0.0], ts[~below] - held, lambda speed: 0.6).position
    values = np.concatenate([np.full(np.count_nonzero(below), 0.3), falls])
    time = found(ts, values, 1e-3, ij.BouncingBall(), ij.Displacement())
    assert time is not None
    assert held <= time < held + 0.12
    assert found(ts[: len(falls)], falls, 1e-3, ij.BouncingBall(), ij.Displacement()) is None


def test_gap_in_record_is_not_a_hand():
    values = bouncing(TS[:1600], [0.8, 0.0])
    valid = (TS[:1600] > 0.005) & (TS[:1600] < 0.06)
    recording = ij.Recording(
        jnp.asarray(TS[:1600]), jnp.asarray(values), ij.Angle(), jnp.asarray(~valid)
    )
    assert recording.free_part(recording.first_look(ij.Pendulum(10.0, length=0.07))) is None


def test_impact_times_and_short_records_have_no_release():
    times = ij.ImpactTimes(jnp.array([0.1, 0.5, 0.8, 1.0]))
    assert times.free_part(times.first_look(ij.BouncingBall())) is None
    assert found(TS[:20], fall(TS[:20], [1.0, 0.0]), 0.0) is None
