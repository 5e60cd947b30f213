"""Velocities and accelerations that were computed from recorded places."""

import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from reference import ball, simulate_rigid
from tiers import quick

TS = np.arange(1400) / 1000
HEIGHTS = simulate_rigid(ball(9.80665), [0.2, 0.0], TS, lambda v: 0.8).position
COMPUTED = {
    "forward": lambda places: np.diff(places, append=places[-1]) / 1e-3,
    "central": lambda places: np.gradient(places, 1e-3),
    "second": lambda places: np.gradient(np.gradient(places, 1e-3), 1e-3),
}


@quick
@pytest.mark.parametrize("difference", COMPUTED)
def test_doubt_about_rates_computed_from_places(difference):
    """No doubt about a sensor of the rate, with white or filtered noise, or about the places."""
    quantity = ij.Acceleration() if difference == "second" else ij.Velocity()
    clean = COMPUTED[difference](HEIGHTS)
    sections = signal.butter(2, 50.0, fs=1000, output="sos")
    for seed in range(5):
        noise = np.random.default_rng(seed).standard_normal(len(TS))
        computed = COMPUTED[difference](HEIGHTS + 1e-3 * noise)
        assert doubts_computation(ij.Recording(TS, computed, quantity)), seed
        for other in (noise, np.asarray(signal.sosfilt(sections, noise))):
            assert not doubts_computation(ij.Recording(TS, clean + 0.05 * other, quantity)), seed


@quick
def test_doubt_about_smooth_noise_of_a_rate():
    """A Savitzky-Golay derivative over seven places; a stated cutoff answers the doubt."""
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(TS))
    smooth = np.asarray(signal.savgol_filter(HEIGHTS + noise, 7, 2, deriv=1, delta=1e-3))
    record = ij.Recording(TS, smooth, ij.Velocity())
    assert doubts_computation(record, "noise is smooth")
    assert not doubts_computation(record, "noise is smooth", cutoff=50.0)


def doubts_computation(record, words="seems to be computed from positions", **fixed):
    told = ij.check(record, oscillator=ij.BouncingBall(), fixed=fixed)
    return any(words in each for each in told.doubts)
