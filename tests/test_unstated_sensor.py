"""Parameters of the sensor that nobody stated, in records with impacts made with SciPy."""

import dataclasses
import functools

import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from impactjax._record.read_recording import read_recording
from records import record_file
from reference import pendulum, simulate_rigid
from tiers import thorough

OMEGA_N, R, DURATION, RATE, FINE = 13.0, 0.6, 1.4, 500, 20_000
TIMES = np.arange(round(DURATION * RATE)) / RATE
NOISE = np.radians(0.2)


def angles(cutoff=np.inf):
    """A pendulum released at 45 degrees that hits a stop, behind a low-pass at 20 kHz."""
    return filtered(motion().position, cutoff)[:: FINE // RATE] + noise(5)


@functools.cache
def motion():
    """The motion of the pendulum at 20 kHz."""
    times = np.arange(round(DURATION * FINE)) / FINE
    return simulate_rigid(pendulum(OMEGA_N), [np.pi / 4, 0.0], times, lambda speed: R)


def filtered(fine, cutoff):
    if not np.isfinite(cutoff):
        return np.asarray(fine)
    sections = signal.butter(2, cutoff, fs=FINE, output="sos")
    return signal.sosfilt(sections, fine, zi=signal.sosfilt_zi(sections) * fine[0])[0]


def rates(cutoff):
    """Angular velocity, with a zero off by half the noise."""
    values = filtered(motion().velocity, cutoff)[:: FINE // RATE] + OMEGA_N * noise(5)
    return ij.Recording(TIMES, values + OMEGA_N * NOISE / 2, ij.AngularVelocity())


def accelerations(cutoff):
    """Angular acceleration: the derivative of the filtered velocity holds the impulses."""
    values = np.gradient(filtered(motion().velocity, cutoff), 1 / FINE)[:: FINE // RATE]
    return ij.Recording(TIMES, values + OMEGA_N**2 * noise(5), ij.AngularAcceleration())


def noise(seed):
    return NOISE * np.random.default_rng(seed).standard_normal(TIMES.size)


def recording(cutoff=np.inf):
    return ij.Recording(TIMES, angles(cutoff), ij.Angle())


def written(path, sidecar):
    return read_recording(record_file(path, "angle [rad]", TIMES, angles(), sidecar))


def experiment(record, **said):
    return ij.prepare(record, laws=["restitution"], **said).experiment


def cutoff(found):
    assert isinstance(found.sensor.low_pass, ij.Butterworth)
    return float(found.sensor.low_pass.cutoff)


def fitted(record):
    return ij.profiled(ij.fit(experiment(record), starts=ij.Starts(4)))


def test_low_pass_is_fitted_with_zero_drift_and_gain(tmp_path):
    for record in (recording(), written(tmp_path / "a.csv", "[sensor]\ndelay = 0.001\n")):
        found = experiment(record)
        assert set(found.free) == {"cutoff", "offset", "drift", "gain"}
        assert cutoff(found) == pytest.approx(RATE / 10)


def test_stated_low_pass_is_kept(tmp_path):
    found = experiment(written(tmp_path / "a.csv", "[sensor]\ncutoff = 50.0\n"))
    assert "cutoff" not in found.free
    assert cutoff(found) == 50.0
    given = experiment(recording(), fixed={"cutoff": 80.0})
    assert "cutoff" in given.fixed
    assert cutoff(given) == 80.0


@pytest.mark.parametrize("record", [rates, accelerations])
def test_sensor_of_a_recorded_rate_is_fitted_unless_stated(record):
    found = experiment(record(45.0))
    assert {"cutoff", "offset", "drift"} <= {*found.free}
    assert cutoff(found) == pytest.approx(RATE / 10)
    stated = experiment(record(45.0), fixed={"cutoff": 45.0, "offset": 0.0, "gain": 1.0})
    assert stated.free == ()


def test_gain_of_a_recorded_rate_is_fitted_where_the_period_depends_on_it():
    record = rates(45.0)
    assert "gain" in experiment(record).free
    linear = ij.Recording(record.ts, record.values, ij.Velocity())
    assert "gain" not in experiment(linear).free


@pytest.mark.parametrize("record", [rates, accelerations])
def test_restitution_of_a_recorded_rate_behind_an_unstated_low_pass(record):
    """Without the low-pass, r of a gyroscope is 15 errors off."""
    estimate = fitted(record(45.0))
    for name, truth in {"cutoff": 45.0, "r": R, "omega_n": OMEGA_N}.items():
        own = estimate[name]
        assert own.verdict is ij.Verdict.IDENTIFIED
        assert abs(own.value - truth) < 3 * own.standard_error, name


def test_infinite_cutoff_means_no_low_pass(tmp_path):
    file = written(tmp_path / "a.csv", "[sensor]\ncutoff = inf\n")
    for found in (experiment(file), experiment(recording(), fixed={"cutoff": np.inf})):
        assert found.sensor.low_pass is None
        assert set(found.free) == {"offset", "drift", "gain"}


def test_order_of_an_unknown_low_pass_is_kept(tmp_path):
    file = written(tmp_path / "a.csv", "[sensor]\norder = 4\n")
    for found in (experiment(file), experiment(file, fixed={"cutoff": 50.0})):
        assert isinstance(found.sensor.low_pass, ij.Butterworth)
        assert found.sensor.low_pass.order == 4


@pytest.mark.parametrize(
    ("said", "fitted_as", "held"),
    [
        ({"free": ["cutoff"]}, 50.0, False),
        ({"start": {"cutoff": 70.0}}, 70.0, True),
        ({"start": {"cutoff": 70.0}, "free": ["cutoff"]}, 70.0, False),
    ],
)
def test_cutoff_can_be_named(said, fitted_as, held):
    found = experiment(recording(), **said)
    assert cutoff(found) == pytest.approx(fitted_as)
    assert ("cutoff" in found.free, "cutoff" in found.fixed) == (not held, held)


def test_arguments_remove_a_stated_low_pass(tmp_path):
    file = written(tmp_path / "a.csv", "[sensor]\ncutoff = 50.0\n")
    assert experiment(file, fixed={"cutoff": np.inf}).sensor.low_pass is None
    assert experiment(recording(), fixed={"cutoff": None}).sensor.low_pass is None


def test_few_samples_have_no_low_pass():
    few = ij.Recording(TIMES[::18], angles()[::18], ij.Angle())
    assert "cutoff" not in experiment(few).free


@thorough
def test_low_pass_that_is_stated_not_to_be_there_is_not_fitted():
    known = {"cutoff": np.inf, "dry_friction": None}
    prepared = ij.prepare(recording(cutoff=45.0), laws=["restitution"], fixed=known)
    assert "cutoff" not in ij.compare(prepared, starts=ij.Starts(4)).best.estimate.names


@thorough
def test_coarse_record_without_low_pass_tells_of_none():
    """Two minima differ little; the intervals hold the values without a low-pass, and the truth."""
    coarse = ij.Recording(TIMES[::5], angles()[::5], ij.Angle())
    estimate = fitted(coarse)
    plain = ij.fit(experiment(coarse, fixed={"cutoff": np.inf}), starts=ij.Starts(4))
    assert float(estimate.rms) <= (1 + 1e-6) * float(plain.rms)
    assert estimate["cutoff"].high == np.inf
    for name, truth in {"theta_dot0": 0.0, "r": R, "omega_n": OMEGA_N}.items():
        own = estimate[name]
        assert own.low <= plain[name].value <= own.high, name
        assert own.low <= truth <= own.high, name


def test_sensor_of_the_user_states_everything():
    assert experiment(recording(), sensor=ij.Sensor()).free == ()


def test_motion_without_impacts_has_no_low_pass():
    swing = ij.Recording(TIMES, 0.1 * np.cos(OMEGA_N * TIMES), ij.Angle())
    (name,) = [x for x in ij.prepare(swing).experiments if "dry" not in x]
    assert ij.prepare(swing).experiments[name].sensor.low_pass is None


def test_low_pass_of_filtered_record_is_found():
    estimate = fitted(recording(cutoff=45.0))
    for name, truth in {"cutoff": 45.0, "r": R, "omega_n": OMEGA_N}.items():
        own = estimate[name]
        assert own.verdict is ij.Verdict.IDENTIFIED
        assert abs(own.value - truth) < 3 * own.standard_error, name


@thorough
def test_intervals_of_filtered_records_cover():
    """At least 17 of 20 hold the truth; with probability 0.95 each, fewer do in 1.6 %."""
    truths, clean = {"cutoff": 45.0, "r": R, "omega_n": OMEGA_N}, angles(45.0) - noise(5)
    held = dict.fromkeys(truths, 0)
    for seed in range(20):
        estimate = fitted(ij.Recording(TIMES, clean + noise(seed), ij.Angle()))
        for name, truth in truths.items():
            held[name] += estimate[name].low <= truth <= estimate[name].high
    assert min(held.values()) >= 17


@thorough
def test_record_without_low_pass_gives_least_cutoff():
    """The interval of the restitution is as wide as without a low-pass."""
    estimate = fitted(recording())
    low_pass = estimate["cutoff"]
    assert low_pass.verdict is ij.Verdict.ONE_SIDED
    assert 50.0 < low_pass.low < 500.0
    assert low_pass.high == np.inf
    plain = experiment(recording(), fixed={"cutoff": np.inf})
    without = ij.profiled(ij.fit(plain, starts=ij.Starts(4)))
    own, other = estimate["r"], without["r"]
    assert other.low <= R <= other.high
    assert own.low <= R <= own.high
    assert own.high - own.low == pytest.approx(other.high - other.low, rel=0.25)


@thorough
@pytest.mark.parametrize("start", [15.0, 500.0])
def test_scattered_starts_find_the_low_pass_from_afar(start):
    """There are several minima; those found differ by less than one in χ²."""
    known = experiment(recording(cutoff=45.0))
    sensor = ij.Sensor(low_pass=ij.Butterworth(start))
    begun = ij.Experiment(known.model, known.recording, known.initial, sensor, free=known.free)
    found = ij.fit(begun, starts=ij.Starts(8))
    best = fitted(recording(cutoff=45.0))
    assert np.sum(np.square(found.residuals) - np.square(best.residuals)) < NOISE**2
    assert found["cutoff"].value == pytest.approx(45.0, abs=3 * found["cutoff"].standard_error)


@thorough
def test_scatter_beside_a_low_pass_that_is_not_there():
    found = dataclasses.replace(experiment(recording()), scatter=ij.NormalScatter())
    estimate = ij.fit(found, starts=ij.Starts(4))
    assert estimate.scatter is not None
    assert float(estimate.scatter.size) < 0.02
    assert estimate["r"].low <= R <= estimate["r"].high
