"""Samples beside impacts that are left out: outliers, and jumps of a velocity."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import line
from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Settings
from impactjax._compare.needless_low_pass import without_needless_low_pass
from impactjax._compare.outliers_of_fit import outliers
from impactjax._fit.search import Search
from reference import ball, simulate_rigid
from tiers import mostly_thorough, quick

TS, SIZE, TRUTH = np.arange(700) / 500, 0.02, 0.7  # noise of a velocity [m/s], and restitution
MOTION = simulate_rigid(ball(), [0.4, 0.0], TS, lambda speed: TRUTH)  # by SciPy


def recorded(wrong, seed=5):
    """Velocity of a ball; `wrong` samples are off by 1 m/s."""
    values = MOTION.velocity + SIZE * np.random.default_rng(seed).standard_normal(len(TS))
    values[wrong] += 1.0
    return ij.Recording(TS, values, ij.Velocity())


def near_jumps(samples):
    """The mask of samples up to some number away from a jump, on each side."""
    after = np.searchsorted(TS, MOTION.impact_times)
    number = np.arange(len(TS))[:, None]
    return np.any((number < after + samples) & (number >= after - samples), axis=1)


def compared(recording):
    prepared = ij.prepare(
        recording, oscillator=ij.BouncingBall(), laws=["restitution"], fixed={"x_dot0": 0.0}
    )
    return ij.compare(prepared, starts=ij.Starts(4))


def test_wrong_samples_beside_impacts_are_left_out():
    """The motion is fast there: of the record alone they are no outliers."""
    wrong = np.searchsorted(TS, MOTION.impact_times[:3]) - 3
    recording = recorded(wrong)
    assert not np.any(recording.outliers())
    found = compared(recording)
    assert "3 of 700 samples are far from the best fit, and left out." in found.notes
    r = found.best.estimate["r"]
    assert r.verdict is ij.Verdict.IDENTIFIED
    assert r.low < TRUTH < r.high
    used = np.asarray(found.best.estimate.problem.recording.valid)
    assert not np.any(used[wrong])
    assert np.count_nonzero(~used & ~near_jumps(3)) == 0


@pytest.mark.parametrize("seed", mostly_thorough([0, 1, 2, 3], 0))
def test_clean_velocity_of_a_rigid_stop_has_no_low_pass_and_no_samples_at_jumps(seed):
    """A jump is between two samples or not: a fitted cutoff explains a wrong answer to that."""
    found = compared(recorded([], seed))
    assert not any("far from the best fit" in note for note in found.notes)
    assert any("does not ask for a low-pass, which was fitted first" in x for x in found.notes)
    used = np.asarray(found.best.estimate.problem.recording.valid)
    assert not np.any(used & near_jumps(1))
    assert np.all(used | near_jumps(3))
    r = found.best.estimate["r"]
    assert r.verdict is ij.Verdict.IDENTIFIED
    assert r.low < TRUTH < r.high


def test_nothing_is_left_out_at_jumps_beside_a_law_of_contacts_that_last():
    prepared = ij.prepare(
        recorded([]), oscillator=ij.BouncingBall(), laws=["restitution"], fixed={"x_dot0": 0.0}
    )
    rigid = Fitted("rigid", ij.fit(prepared.experiment, starts=ij.Starts(4)), 0.0, (), ())
    last = jnp.ones(rigid.estimate.impacts.duration.shape)
    soft = eqx.tree_at(lambda each: each.estimate.impacts.duration, rigid, last)
    settings = Settings(ij.Starts(1), ij.LevenbergMarquardt(), Search(), lambda _: None, map)

    def left_out(fits):
        own = dict.fromkeys(fits, prepared.experiment)
        return without_needless_low_pass(prepared.possible_low_pass, own, fits, settings)

    assert left_out({"rigid": rigid}) is not None
    assert left_out({"rigid": rigid, "soft": soft}) is None


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
