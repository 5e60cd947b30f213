"""Two turns between two places at which a step is looked at."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._simulate.dip import closest_to_zero
from tiers import thorough

GRAVITY, NODES = 9.81, 5


@pytest.mark.parametrize("sign", [-1, 1])
def test_closest_approach_of_cubics(sign):
    """Against a fine grid."""
    draw = np.random.default_rng(4).uniform
    at, fine = np.linspace(0.0, 1.0, NODES), np.linspace(0.0, 1.0, 40001)
    compared = 0
    for _ in range(600):
        cubic = np.polynomial.Polynomial.fromroots(draw(-0.5, 1.5, 3))
        values, slopes = cubic(at), cubic.deriv()(at) / (NODES - 1)
        if np.ptp(np.sign(values)) > 0:
            continue  # it changes sign where everybody sees it
        found = float(closest_to_zero(jnp.asarray(sign * values), jnp.asarray(sign * slopes)))
        least = np.abs(cubic(at)).min()
        dips = np.sign(values[0]) * cubic(fine)
        if dips.min() < least - 1e-12:
            compared += 1
            assert found == pytest.approx(fine[np.argmin(dips)], abs=1e-4)
    assert compared > 20


def bounced(end, parameters):
    amplitude, frequency, phase, height, velocity = parameters
    base = ij.HarmonicMotion(amplitude, frequency, phase)
    ball = ij.BouncingBall(GRAVITY, base=base)
    run = ij.simulate(
        ij.ImpactOscillator(ball, ij.Stop(ij.Restitution(0.5))),
        ij.InitialState(height, velocity),
        end[None],
        t0=0.0,
        max_steps=64,
        max_impacts=4,
    )
    return run.nearest_miss, run.impacts.count


def flight(lanes, t):
    """Height over the floor, and its rate, with x″ = A ω² sin(ω t + φ) − g."""
    amplitude, frequency, phase, height, velocity = lanes.T[..., None]
    drift = velocity + amplitude * frequency * np.cos(phase)
    place = height + amplitude * np.sin(phase) + drift * t - GRAVITY * t**2 / 2
    angle = frequency * t + phase
    rate = drift - GRAVITY * t - amplitude * frequency * np.cos(angle)
    return place - amplitude * np.sin(angle), rate


def with_close_turns(t):
    """Flights of which the rate comes close to zero between two turns, or away from them."""
    draw = np.random.default_rng(8).uniform
    amplitude, frequency, phase, _, _ = lanes = draw(
        [[0.2], [8.0], [0.0], [1.0], [0.0]], [[0.3], [11.0], [6.3], [1.5], [0.0]], (5, 2000)
    )
    steepest = np.arcsin(GRAVITY / (amplitude * frequency**2))  # angle at which the rate is extreme
    steepest = np.where(draw(size=2000) < 0.5, steepest, np.pi - steepest)
    extreme = ((steepest - phase) % (2 * np.pi)) / frequency
    _, rate = flight(lanes.T, extreme[:, None])
    size = draw(2e-4, 1e-2, 2000) * np.sign(draw(-1, 1, 2000))
    lanes[4] = size - rate[:, 0]
    place, rate = flight(lanes.T, t)
    close = (extreme > 0.05) & (extreme < t[-1] - 0.05) & (place.min(axis=1) > 0.01)
    return lanes.T[close], place[close], rate[close]


@thorough
def test_nearest_miss_of_ball_over_shaking_floor():
    """In closed form, on a fine grid."""
    t = np.linspace(0.0, 0.6, 3001)
    lanes, place, rate = with_close_turns(t)
    assert len(lanes) > 100
    turns = (rate[:, :-1] < 0) & (rate[:, 1:] >= 0)
    last = np.where(rate[:, -1] < 0, place[:, -1], np.inf)
    expected = np.minimum(np.where(turns, place[:, 1:], np.inf).min(axis=1), last)
    end = jnp.full(len(lanes), t[-1])
    found, count = jax.jit(jax.vmap(bounced))(end, jnp.asarray(lanes))
    assert not np.any(count)
    np.testing.assert_allclose(found, expected, atol=1e-5)
