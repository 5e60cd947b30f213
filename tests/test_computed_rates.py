"""Velocities and accelerations that were computed from recorded places."""

import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from impactjax._record.restored import restored
from reference import ball, simulate_compliant, simulate_rigid
from tiers import quick

TS = np.arange(1400) / 1000
BALL = ij.BouncingBall()
HEIGHTS = simulate_rigid(ball(9.80665), [0.2, 0.0], TS, lambda v: 0.8).position
COMPUTED = {
    "forward": lambda places: np.diff(places, append=places[-1]) / 1e-3,
    "central": lambda places: np.gradient(places, 1e-3),
    "second": lambda places: np.gradient(np.gradient(places, 1e-3), 1e-3),
}


@quick
@pytest.mark.parametrize("difference", COMPUTED)
def test_rates_computed_from_places_are_recognised(difference):
    """Places are restored from a velocity, unless noise hides its impacts; else there is a doubt.
    A sensor of the rate, with white or filtered noise, is neither.
    """
    quantity = ij.Acceleration() if difference == "second" else ij.Velocity()
    clean = COMPUTED[difference](HEIGHTS)
    sections = signal.butter(2, 50.0, fs=1000, output="sos")
    for seed in range(5):
        noise = np.random.default_rng(seed).standard_normal(len(TS))
        for size in (1e-3, 1e-4):
            record = ij.Recording(TS, COMPUTED[difference](HEIGHTS + size * noise), quantity)
            sums = difference != "second" and size == 1e-4
            assert doubts_computation(record) is not sums, seed
            assert is_restored(record) is sums, seed
        for other in (noise, np.asarray(signal.sosfilt(sections, noise))):
            record = ij.Recording(TS, clean + 0.05 * other, quantity)
            assert not doubts_computation(record), seed
            assert not is_restored(record), seed


@quick
@pytest.mark.parametrize("difference", ["forward", "central"])
@pytest.mark.parametrize("count", [1400, 1399])
def test_sums_restore_places(difference, count):
    """Up to a constant, and of central differences one tenth of the noise between odd and even."""
    noise = 1e-3 * np.random.default_rng(7).standard_normal(count)
    places = HEIGHTS[:count] + noise
    found = restored(TS[:count], COMPUTED[difference](places), np.zeros(1))
    assert found is not None
    assert np.std(found - places) < (1e-4 if difference == "central" else 1e-12)


@quick
def test_uneven_samples_are_not_summed():
    places = HEIGHTS + 1e-3 * np.random.default_rng(7).standard_normal(len(TS))
    ts = np.where(np.arange(len(TS)) > 700, TS + 5e-4, TS)
    assert restored(TS, COMPUTED["central"](places), np.zeros(1)) is not None
    assert restored(ts, COMPUTED["central"](places), np.zeros(1)) is None
    assert (
        restored(TS, np.where(TS == 0.5, np.nan, COMPUTED["central"](places)), np.zeros(1)) is None
    )


@quick
@pytest.mark.parametrize(
    "stated", [{"fixed": {"cutoff": 100.0}}, {"fixed": {"offset": 0.0}}, {"sensor": ij.Sensor()}]
)
def test_velocity_of_a_stated_sensor_is_kept(stated):
    places = HEIGHTS + 1e-4 * np.random.default_rng(7).standard_normal(len(TS))
    record = ij.Recording(TS, COMPUTED["central"](places), ij.Velocity())
    assert is_restored(record)
    assert not is_restored(record, **stated)


@quick
def test_velocity_with_gaps_is_kept():
    """A sum over a sample that does not count has a step."""
    places = HEIGHTS + 1e-4 * np.random.default_rng(7).standard_normal(len(TS))
    record = ij.Recording(TS, COMPUTED["central"](places), ij.Velocity(), TS != 0.1)
    assert not is_restored(record)


@quick
def test_free_swing_is_kept():
    """Its differences smooth no impact."""
    noise = 1e-4 * np.random.default_rng(7).standard_normal(len(TS))
    computed = COMPUTED["central"](np.cos(20 * TS) + noise)
    assert not is_restored(
        ij.Recording(TS, computed, ij.Velocity()), oscillator=ij.LinearOscillator(20.0)
    )


def test_natural_frequency_of_a_contact_from_computed_velocity():
    """Fitted as a filtered velocity, the record gives 147.6 ± 0.6 rad/s."""
    ts = np.arange(700) / 500
    contact = 150.0

    def touching(t, y):
        return np.array([y[1], -(contact**2) * y[0] - 2 * 0.15 * contact * y[1] - 9.80665])

    motion = simulate_compliant(ball(), touching, [0.2, 0.0], ts)
    noise = 3e-5 * np.random.default_rng(2).standard_normal(len(ts))
    computed = np.gradient(motion.position + noise, 1 / 500)
    prepared = ij.prepare(
        ij.Recording(ts, computed, ij.Velocity()),
        oscillator=ij.BouncingBall(),
        laws=[ij.KelvinVoigt(120.0, 0.2)],
    )
    found = ij.fit(prepared.experiment, starts=ij.Starts(4))["omega0"]
    assert found.low < contact < found.high
    assert found.standard_error < 0.01 * contact


@quick
def test_doubt_about_smooth_noise_of_a_rate():
    """A Savitzky-Golay derivative over seven places; a stated cutoff answers the doubt."""
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(TS))
    smooth = np.asarray(signal.savgol_filter(HEIGHTS + noise, 7, 2, deriv=1, delta=1e-3))
    record = ij.Recording(TS, smooth, ij.Velocity())
    assert doubts_computation(record, "noise is smooth")
    assert not doubts_computation(record, "noise is smooth", cutoff=50.0)


def is_restored(record, oscillator: ij.AbstractOscillator = BALL, **stated):
    told = ij.prepare(record, oscillator=oscillator, laws=["restitution"], **stated)
    assert told.experiment.recording.shows_rate is not told.experiment.recording.shows_place
    noted = any("restored by sums" in each for each in told.notes)
    assert noted is told.experiment.recording.shows_place
    return noted


def doubts_computation(record, words="seems to be computed from positions", **fixed):
    told = ij.check(record, oscillator=ij.BouncingBall(), fixed=fixed)
    return any(words in each for each in told.doubts)
