"""Arguments of recordings, and the observations that a fit uses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from estimates import SMALL
from tiers import mostly_thorough, thorough

TS = np.array([0.0, 0.1, 0.2, 0.3])


def as_mask(valid):
    return None if valid is None else np.array(valid)


@pytest.mark.parametrize(
    ("ts", "values", "valid", "words"),
    [
        ([], [], None, "`ts` must be a list of at least one number"),
        (TS[None], TS[None], None, "its shape is"),
        (TS, TS[:3], None, "There are 3 `values` for 4 times"),
        (TS, TS + 1j, None, "must be real, but it is of type complex"),
        (TS[::-1], TS, None, "`ts` must increase strictly, but 0.2 follows 0.3"),
        ([0.0, 0.1, np.nan, 0.3], TS, None, "`ts` must increase strictly"),
        (TS, TS, [1, 1, 1, 0], "`valid` must be true or false for each of 4"),
        (TS, TS, [True], "`valid` must be true or false for each of 4"),
    ],
)
def test_recording_refuses_wrong_arguments(ts, values, valid, words):
    with pytest.raises(ValueError, match=words):
        ij.Recording(np.array(ts), np.array(values), ij.Displacement(), as_mask(valid))


@pytest.mark.parametrize(
    ("times", "valid", "words"),
    [
        ([], None, "`times` must be a list of at least one number"),
        ([[0.1]], None, "its shape is"),
        ([0.1, 0.3, 0.2], None, "`times` must increase strictly, but 0.2"),
        ([0.1, 0.2, 0.2], None, "`times` must increase strictly"),
        ([0.1, 0.3, np.nan, 0.2], None, "`times` must increase strictly"),
        ([np.nan, 0.1, 0.2], None, "first of the impact times has to be known"),
        ([0.1, 0.2], [1, 1], "`valid` must be true or false for each of 2"),
    ],
)
def test_impact_times_refuse_wrong_arguments(times, valid, words):
    with pytest.raises(ValueError, match=words):
        ij.ImpactTimes(np.array(times), as_mask(valid))


def test_recording_accepts_integers():
    recording = ij.Recording(np.arange(3), np.arange(3), ij.Displacement())
    assert recording.ts.dtype == recording.values.dtype == jnp.result_type(float)


def test_non_finite_observations_do_not_count():
    recording = ij.Recording(TS, np.array([0.0, np.nan, np.inf, 0.3]), ij.Displacement())
    assert recording.valid.tolist() == [True, False, False, True]
    values = np.array([0.0, np.nan, 0.2, 0.3])
    masked = ij.Recording(TS, values, ij.Displacement(), TS > 0)
    assert masked.valid.tolist() == [False, False, True, True]
    assert ij.ImpactTimes(np.array([0.1, np.nan, 0.3])).valid.tolist() == [True, False, True]


@pytest.mark.parametrize("missed", mostly_thorough([4, 8], 8))
def test_missed_impact_keeps_its_number(missed):
    r, speed, gravity = 0.8, 1.5, 9.80665
    times = 0.1 + 2 * speed / gravity * (1 - r ** np.arange(9)) / (1 - r)
    times[missed] = np.nan
    found = ij.fit(
        ij.Experiment(
            ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.75))),
            ij.ImpactTimes(times),
            ij.InitialState(0.0, 1.4),
            simulation=SMALL,
        )
    )
    np.testing.assert_allclose(found.value("r"), r, rtol=1e-7)
    assert bool(found.converged)


@thorough
def test_all_invalid_recording_does_not_converge_under_jit():
    """Under `jit`, where nobody can be told."""

    @jax.jit
    def outcome(valid):
        recording = ij.Recording(TS, TS, ij.Displacement(), valid)
        start = ij.InitialState(0.0, 1.0)
        model = ij.ImpactOscillator(ij.FreeMass())
        return ij.fit(ij.Experiment(model, recording, start, simulation=SMALL)).outcome

    assert int(outcome(jnp.ones(4, bool))) == ij.Outcome.CONVERGED
    assert int(outcome(jnp.zeros(4, bool))) == ij.Outcome.TOO_FEW_OBSERVATIONS


def test_whole_record_contains_all_samples():
    """To the last observation, however its time is rounded."""
    times = np.cumsum(np.random.default_rng(0).uniform(0.01, 1.0, (200, 25)), axis=1)
    for each in jnp.asarray(times):
        assert ij.ImpactTimes(each).truncated(1.0).valid.all()
        assert ij.Recording(each, each, ij.Angle()).truncated(1.0).valid.all()
