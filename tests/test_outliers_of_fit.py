"""Outliers beside impacts, which only a fit shows."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from scipy import signal

import impactjax as ij
from estimates import line
from impactjax._compare.outliers_of_fit import outliers
from reference import ball, simulate_rigid
from tiers import quick

RATE, FINE = 500, 20_000  # of the record and of its integration [Hz]
TS, SIZE, TRUTH = np.arange(690) / RATE, 0.02, 0.7  # noise of a velocity [m/s], and restitution
FINE_TS = np.arange(690 * FINE // RATE) / FINE
MOTION = simulate_rigid(ball(), [0.4, 0.0], FINE_TS, lambda speed: TRUTH)  # by SciPy
LOW_PASS = signal.butter(2, 60.0, fs=FINE, output="sos")


def recorded(wrong, seed=5):
    """Velocity of a ball behind a low-pass; `wrong` samples are off by 1 m/s."""
    values = signal.sosfilt(LOW_PASS, MOTION.velocity)[:: FINE // RATE]
    values += SIZE * np.random.default_rng(seed).standard_normal(len(TS))
    values[wrong] += 1.0
    return ij.Recording(TS, values, ij.Velocity())


def compared(recording):
    prepared = ij.prepare(
        recording, oscillator=ij.BouncingBall(), laws=["restitution"], fixed={"x_dot0": 0.0}
    )
    return ij.compare(prepared, starts=ij.Starts(4))


def test_wrong_samples_beside_impacts_are_left_out():
    """The motion is fast there: of the record alone they are no outliers."""
    wrong = np.searchsorted(TS, MOTION.impact_times[:3]) + 1
    recording = recorded(wrong)
    assert not np.any(recording.outliers()[wrong])
    found = compared(recording)
    assert any("far from the best fit, and left out" in note for note in found.notes)
    r = found.best.estimate["r"]
    assert r.verdict is ij.Verdict.IDENTIFIED
    assert r.low < TRUTH < r.high
    used = np.asarray(found.best.estimate.problem.recording.valid)
    assert not np.any(used[wrong])
    assert np.count_nonzero(~used) <= len(wrong) + 1


@quick
def test_steps_of_a_record_that_stands_still_at_last_are_no_outliers():
    """The noise from sample to sample is nearly zero where a coarse record stands still."""
    ts = np.arange(2000) / 1000
    places = np.where(ts < 0.8, np.cos(20 * ts), np.cos(16.0))
    recording = ij.Recording(ts, np.round(places, 2), ij.Displacement())
    steps = places - np.asarray(recording.values)
    assert np.count_nonzero(recording.outliers(steps)) > 0
    for size, expected in ((0.0, []), (0.5, [300])):
        residuals = steps + np.where(ts == 0.3, size, 0.0)
        found = dataclasses.replace(
            line()[1],
            residuals=jnp.asarray(residuals),
            jacobian=jnp.zeros((2000, 2)),
            rms=jnp.sqrt(jnp.mean(residuals**2)),
        )
        np.testing.assert_array_equal(np.flatnonzero(outliers(found, recording)), expected)


@quick
def test_impacts_that_are_observed_have_no_outliers():
    """An impact time that is wrong may be a missed impact."""
    times = ij.ImpactTimes(np.array([0.1, 0.5, 0.8, 1.0]))
    assert not np.any(times.outliers(np.array([0.0, 1.0, 0.0, 0.0])))
