"""Sign of a record and place of its stop, which `prepare` finds where no sidecar states them."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from impactjax._compare.compare import compare_by
from impactjax._fit.search import Search
from impactjax._record.read_recording import read_recording
from impactjax._report.words import sentences
from records import record_file
from reference import ball, simulate_rigid, spring

OMEGA, R, NOISE = 25.0, 0.65, 1e-4
TS = np.arange(1000) / 1000


def written(path, values, sidecar=""):
    return read_recording(record_file(path, "displacement [m]", TS, values, sidecar))


def impacting(gap):
    """A mass on a spring, from 30 mm, that hits a stop at −gap, by SciPy."""
    found = (
        simulate_rigid(spring(OMEGA, gap), [0.03 + gap, 0.0], TS, lambda speed: R).position - gap
    )
    return found + NOISE * np.random.default_rng(4).standard_normal(len(TS))


@pytest.fixture(scope="module")
def at_rest():
    return impacting(0.0)


@pytest.fixture(scope="module")
def beside():
    return impacting(0.008)


def test_zero_drift_and_low_pass_are_fitted_and_stop_at_zero_is_not(tmp_path, at_rest):
    prepared = ij.prepare(written(tmp_path / "a.csv", at_rest))
    assert prepared.notes == ()
    for experiment in prepared.experiments.values():
        assert experiment.free == ("offset", "drift", "cutoff")


def test_record_of_opposite_sign_is_turned(tmp_path, at_rest):
    prepared = ij.prepare(written(tmp_path / "a.csv", -at_rest), laws=["restitution"])
    (note,) = prepared.notes
    assert "sign is turned" in note
    recording = prepared.experiment.recording
    assert isinstance(recording, ij.Recording)
    np.testing.assert_allclose(recording.values, at_rest)


def rates(quantity):
    """Velocity of the mass behind a low-pass of 80 Hz, or the derivative of it."""
    fine = np.arange(20_000) / 20_000
    found = simulate_rigid(spring(OMEGA, 0.0), [0.03, 0.0], fine, lambda speed: R).velocity
    filtered = signal.sosfilt(signal.butter(2, 80.0, fs=20_000, output="sos"), found)
    filtered = np.gradient(filtered, 5e-5) if quantity == ij.Acceleration() else filtered
    noise = np.random.default_rng(4).standard_normal(len(TS))
    return filtered[::20] + 1e-2 * np.std(filtered) * noise


@pytest.mark.parametrize("quantity", [ij.Velocity(), ij.Acceleration()])
def test_rates_of_opposite_sign_are_turned(quantity):
    values = rates(quantity)
    kept = ij.prepare(ij.Recording(TS, values, quantity), laws=["restitution"])
    assert not any("sign is turned" in note for note in kept.notes)
    against = ij.Recording(TS, -values, quantity)
    turned = ij.prepare(against, laws=["restitution"])
    assert any("negative in a rebound" in note for note in turned.notes)
    np.testing.assert_allclose(turned.first_look.restitutions, kept.first_look.restitutions)
    stated = ij.prepare(against, laws=["restitution"], fixed={"gain": 1.0})
    assert not any("sign is turned" in note for note in stated.notes)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_velocity_of_a_free_swing_is_not_turned(sign):
    swing = sign * OMEGA * np.cos(OMEGA * TS) * np.exp(-TS)
    prepared = ij.prepare(ij.Recording(TS, swing, ij.Velocity()))
    assert not any("sign is turned" in note for note in prepared.notes)


@pytest.mark.parametrize("sidecar", ["[sensor]\ngain = 1.0\n", "[start]\nx0 = -0.03\n"])
def test_stated_sign_is_kept(tmp_path, at_rest, sidecar):
    file = written(tmp_path / "a.csv", -at_rest, sidecar)
    recording = ij.prepare(file, laws=["restitution"]).experiment.recording
    assert isinstance(recording, ij.Recording)
    np.testing.assert_allclose(recording.values, -at_rest)


def test_gap_beside_equilibrium_is_fitted(tmp_path, beside):
    prepared = ij.prepare(written(tmp_path / "a.csv", beside))
    (note,) = prepared.notes
    assert note.startswith("The impacts seem to be at -7.")
    experiment = prepared.experiments["restitution"]
    assert set(experiment.free) == {"gap", "offset", "drift", "cutoff"}
    assert experiment.model.lower is not None
    assert float(experiment.model.lower.gap) == pytest.approx(0.008, abs=5e-4)


def test_floor_of_ball_is_fitted_as_offset(tmp_path):
    heights = simulate_rigid(ball(), [0.2, 0.0], TS, lambda speed: 0.8).position + 0.5
    file = written(tmp_path / "a.csv", heights)
    prepared = ij.prepare(file, oscillator=ij.BouncingBall(), laws=["restitution"])
    assert prepared.experiment.free == ("offset", "drift", "cutoff")
    assert float(prepared.experiment.sensor.offset) == pytest.approx(0.5, abs=5e-3)


@pytest.mark.parametrize(
    ("sidecar", "free"),
    [
        ("[fixed]\ngap = 0.008\n", {"offset", "drift", "cutoff"}),
        ('[fit]\nfree = ["gap"]\n', {"gap", "offset", "drift", "cutoff"}),
        ("[sensor]\noffset = 0.0\n", {"cutoff"}),
        ("[fixed]\ngap = 0.008\n[sensor]\ndrift = 0.0\n", {"offset", "cutoff"}),
    ],
)
def test_stated_stop_is_not_fitted(tmp_path, beside, sidecar, free):
    file = written(tmp_path / "a.csv", beside, sidecar)
    prepared = ij.prepare(file, laws=["restitution"])
    assert prepared.notes == ()
    assert {*prepared.experiment.free} == free


def test_sharp_turns_are_not_a_free_swing(tmp_path, beside):
    recording = written(tmp_path / "a.csv", beside).recording
    assert "restitution" in ij.prepare(recording).experiments


def test_misfitting_law_identifies_nothing(tmp_path):
    swing = 0.03 * np.cos(OMEGA * TS) + 0.01 * np.cos(1.7 * OMEGA * TS)
    prepared = ij.prepare(written(tmp_path / "a.csv", swing).recording, laws=["none"])
    fitted = ij.compare({"swing": prepared.experiments["free flight"]}).best
    assert float(fitted.estimate.misfit) > 0.05
    assert np.all(np.asarray(fitted.estimate.verdicts) == ij.Verdict.NOT_IDENTIFIED)
    assert any("None of the laws describes the record" in each for each in sentences([fitted]))


def test_models_are_fitted_in_parallel(tmp_path):
    noise = NOISE * np.random.default_rng(0).standard_normal(TS.size)
    swing = 0.03 * np.exp(-0.05 * OMEGA * TS) * np.cos(OMEGA * TS) + noise
    prepared = ij.prepare(written(tmp_path / "a.csv", swing).recording, laws=["none"])
    in_turn = ij.compare(prepared)
    with ThreadPoolExecutor(2) as pool:
        optimiser = ij.LevenbergMarquardt()
        together = compare_by(
            Search(), prepared, ij.Starts(16), optimiser, lambda _: None, pool.map
        )
    assert [each.name for each in together] == [each.name for each in in_turn]
    assert sorted(each.is_dry for each in together) == [False, True]
    for one, other in zip(in_turn, together, strict=True):
        np.testing.assert_array_equal(one.estimate.values, other.estimate.values)
        assert one.estimate.names == other.estimate.names


def test_no_models_give_no_fits():
    nothing = ij.compare({})
    assert len(nothing) == 0
    assert ij.across([]) == {}
    with pytest.raises(ValueError, match="No model was fitted"):
        _ = nothing.best


def test_laws_of_ones_own_start_from_their_own_values(tmp_path, at_rest):
    recording = written(tmp_path / "a.csv", at_rest).recording
    laws = ["restitution", ij.Restitution(0.6), ij.Restitution(0.7), "restitution"]
    experiments = ij.prepare(recording, laws=laws).experiments
    assert list(experiments) == ["restitution", "Restitution", "Restitution 2"]
    stops = [experiments[name].model.lower for name in ("Restitution", "Restitution 2")]
    laws_of = [stop.law for stop in stops if stop is not None]
    assert [float(law.r) for law in laws_of if isinstance(law, ij.Restitution)] == [0.6, 0.7]
