"""Residuals larger than the noise, at impacts or everywhere, leave nothing identified."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from impactjax._problem.misfit import exceeds_noise
from impactjax._report.words import sentences
from reference import ball, simulate_rigid

COUNT, NEAR = 1400, 24
SIZE = 1e-3  # of the noise [m]
TS = np.arange(700) / 500


def share_found(at_impacts, everywhere, known):
    """Share of 400 records of normal noise whose residuals exceed it, by factors on its size."""
    white = np.random.default_rng(1).standard_normal((400, COUNT)) * everywhere
    beside = np.arange(COUNT) < NEAR
    residuals = np.where(beside, at_impacts, 1.0) * white

    def exceeds(one):
        return exceeds_noise(one, np.ones(COUNT, bool), beside, np.ones(()) if known else None)

    alone = [bool(exceeds(one)) for one in residuals[:20]]
    found = np.asarray(jax.vmap(exceeds)(residuals))
    assert list(found[:20]) == alone
    return np.mean(found)


def test_noise_does_not_exceed_itself():
    assert share_found(1.0, 1.0, known=False) == 0
    assert share_found(1.5, 1.0, known=False) < 0.1
    assert share_found(1.0, 5.0, known=False) == 0
    assert share_found(1.0, 1.4, known=True) == 0


def test_larger_residuals_are_found():
    assert share_found(3.0, 1.0, known=False) > 0.99
    assert share_found(1.0, 1.6, known=True) == 1


def test_few_residuals_are_no_evidence():
    white = np.random.default_rng(2).standard_normal((1000, 6))
    found = [
        bool(exceeds_noise(one, np.ones(6, bool), np.zeros(6, bool), np.ones(()))) for one in white
    ]
    assert np.mean(found) < 0.01
    none = exceeds_noise(np.zeros(6), np.ones(6, bool), np.arange(6) < 3, None)
    assert not bool(none)


def impact_log(begin, durations, complete):
    zeros = jnp.zeros(len(begin))
    return ij.ImpactLog(
        count=jnp.array(2),
        time=jnp.array(begin),
        stop=jnp.zeros(len(begin), int),
        approach_speed=zeros,
        separation_speed=zeros,
        restitution=zeros,
        duration=jnp.array(durations),
        energy_lost=zeros,
        complete=jnp.array(complete),
    )


def test_samples_at_impacts_are_two_on_each_side():
    """A rigid impact between samples 9 and 10, and a contact from 20 to 23, all 0.2 s later."""
    ts = np.arange(40) / 10
    recording = ij.Recording(ts, np.zeros(40), ij.Displacement())
    log = impact_log([0.75, 1.81, 0.0], [0.0, 0.3, 0.0], [True, True, False])
    found = np.flatnonzero(recording.at_impacts(log, np.array(0.2)))
    np.testing.assert_array_equal(found, [8, 9, 10, 11, *range(19, 26)])
    last = impact_log([0.75, 3.31, 0.0], [0.0, 0.0, 0.0], [True, False, False])
    found = np.flatnonzero(recording.at_impacts(last, np.array(0.2)))
    np.testing.assert_array_equal(found, [8, 9, 10, 11, *range(34, 40)])
    times = ij.ImpactTimes(np.array([0.1, 0.5, 0.8]))
    assert not np.any(times.at_impacts(log, np.array(0.0)))


def bouncing(smoothed):
    """Height of a ball by SciPy, its corners perhaps rounded as by an unstated filter."""
    height = simulate_rigid(ball(), [0.4, 0.0], TS, lambda speed: 0.7).position
    if smoothed:
        height = signal.sosfiltfilt(signal.butter(2, 30.0, fs=500, output="sos"), height)
    return height + SIZE * np.random.default_rng(3).standard_normal(len(TS))


def experiment(values, sigma=None):
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.72)))
    recording, sensor = ij.Recording(TS, values, ij.Displacement()), ij.Sensor(sigma=sigma)
    start, known = ij.InitialState(0.4), {"x_dot0": 0.0}
    return ij.Experiment(model, recording, start, sensor, fixed=known)


@pytest.mark.parametrize(
    ("smoothed", "sigma", "reason"),
    [
        (False, None, ij.Reason.BOUNDED),
        (False, SIZE, ij.Reason.BOUNDED),
        (True, None, ij.Reason.EXCEEDS_NOISE),
        (False, 0.5 * SIZE, ij.Reason.EXCEEDS_NOISE),
    ],
)
def test_larger_residuals_leave_nothing_identified(smoothed, sigma, reason):
    doubtful = reason is ij.Reason.EXCEEDS_NOISE
    verdict = ij.Verdict.UNDECIDED if doubtful else ij.Verdict.IDENTIFIED
    found = ij.fit(experiment(bouncing(smoothed), sigma))
    assert bool(found.exceeds_noise) is doubtful
    for each in (found, ij.profiled(found)):
        assert [each.verdict(name) for name in each.names] == [verdict] * 2
        assert [each.reason(name) for name in each.names] == [reason] * 2
    said = " ".join(sentences([ij.Fitted("restitution", found, 0.0)]))
    assert ("at impacts are more than twice as large" in said) is smoothed
    assert ("times the stated noise" in said) is (doubtful and not smoothed)


def test_larger_residuals_of_one_among_several_fits():
    """In a batch they concern one fit, in a joint fit all."""
    smoothed, clean = jnp.asarray(bouncing(True)), jnp.asarray(bouncing(False))
    batch = jax.jit(jax.vmap(lambda values: ij.fit(experiment(values))))
    found = batch(jnp.stack([smoothed, clean]))
    assert found.exceeds_noise.tolist() == [True, False]
    assert found.verdicts.tolist() == [[ij.Verdict.UNDECIDED] * 2, [ij.Verdict.IDENTIFIED] * 2]
    joint = ij.fit_together([experiment(clean), experiment(smoothed)])
    assert {joint.reason(name) for name in joint.names} == {ij.Reason.EXCEEDS_NOISE}
