"""Predictions of the end of a record and of another one, against straight lines by NumPy."""

import dataclasses
import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import command
import impactjax as ij
from estimates import SMALL, TS
from impactjax._compare.holdout import fitted_part, prediction, prediction_of_another
from impactjax._fit.search import Search
from impactjax._outcome import Outcome
from impactjax._report.document import document
from impactjax._report.page import page
from impactjax._report.words import sentences
from reference import pendulum, simulate_rigid
from tiers import quick, thorough

DATA = Path(__file__).parent.parent / "data" / "restitution.csv"
VALUES = 0.3 + 0.7 * TS + 0.05 * np.random.default_rng(1).standard_normal(31)


def experiment(valid: np.ndarray | None = None) -> ij.Experiment:
    recording = ij.Recording(TS, VALUES, ij.Displacement(), valid)
    model = ij.ImpactOscillator(ij.FreeMass())
    return ij.Experiment(model, recording, ij.InitialState(0.0), simulation=SMALL)


def test_prediction_is_that_of_the_line_through_the_first_part():
    valid = np.ones(31, bool)
    valid[[3, 28]] = False
    compared = ij.compare({"line": experiment(valid)}, starts=ij.Starts(2), holdout=0.3)
    fitted = compared.best
    kept = np.flatnonzero(valid)[:20]  # of 29, nine of which are held out
    rest = np.flatnonzero(valid)[20:]
    slope, start = np.polyfit(TS[kept], VALUES[kept], 1)
    left = start + slope * TS[rest] - VALUES[rest]
    assert fitted.prediction is not None
    assert fitted.prediction.observations == 9
    np.testing.assert_allclose(fitted.prediction.rms, np.sqrt(np.mean(left**2)), rtol=1e-6)
    np.testing.assert_allclose(fitted.estimate.value("x_dot0"), slope, rtol=1e-6)
    said = next(each for each in sentences(compared.fits) if "held out" in each)
    assert f"line {1e3 * fitted.prediction.rms:.3g};" in said
    written = document([compared])["fits"][0]["prediction"]
    assert json.loads(json.dumps(written))["n_samples"] == 9
    assert "rms held out" in page([compared], "")


def test_sample_that_a_fit_left_out_is_not_held_out():
    kept = (np.arange(31) < 22) & (np.arange(31) != 8)
    found, whole = ij.fit(experiment(kept)), experiment().recording
    predicted = prediction(found, whole, 0.3, ij.LevenbergMarquardt(), Search())
    assert predicted.observations == 9
    slope, start = np.polyfit(TS[kept], VALUES[kept], 1)
    left = start + slope * TS[22:] - VALUES[22:]
    assert predicted.rms == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)


def test_nothing_is_held_out_by_default():
    compared = ij.compare({"line": experiment()}, starts=ij.Starts(2))
    assert compared.best.prediction is None
    assert "held out" not in page([compared], "")


def test_impact_times_are_held_out_by_number():
    """A ball that loses nothing: its flights are equal, so that the prediction is exact."""
    times = 0.1 + 0.5 * np.arange(10)
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.9)))
    own = ij.Experiment(
        model,
        ij.ImpactTimes(times),
        ij.InitialState(0.0, 2.4),
        simulation=ij.Simulation(max_steps=64, max_impacts=16),
        scatter=ij.NoScatter(),
    )
    part = fitted_part(own.recording, 0.2)
    found = ij.fit(dataclasses.replace(own, recording=part))
    assert int(found.problem.observations) == 8
    predicted = prediction(found, own.recording, 0.2, ij.LevenbergMarquardt(), Search())
    assert predicted.observations == 2
    assert predicted.rms < 1e-6


def test_prediction_of_scattering_impacts_begins_at_the_last_fitted_one():
    """By hand: the last fitted flight, shortened by r at each impact that was held out."""
    random = np.random.default_rng(8)
    flights = 0.6 * np.cumprod(0.85 * np.exp(0.02 * random.standard_normal(13)))
    times = 0.1 + np.concatenate([[0.0], np.cumsum(flights)]) + 1e-6 * random.standard_normal(14)
    model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.8)))
    own = ij.Experiment(
        model,
        ij.ImpactTimes(times),
        ij.InitialState(0.0, 2.4),
        simulation=ij.Simulation(max_steps=64, max_impacts=16),
    )
    found = ij.fit(dataclasses.replace(own, recording=fitted_part(own.recording, 3 / 14)))
    assert found.scatter is not None
    predicted = prediction(found, own.recording, 3 / 14, ij.LevenbergMarquardt(), Search())
    fitted = times + np.asarray(found.residuals)
    flight = fitted[10] - fitted[9]
    expected = fitted[10] + np.cumsum(flight * float(found.value("r")) ** np.arange(1, 4))
    missed = np.sqrt(np.mean((expected - times[11:]) ** 2))
    assert predicted.observations == 3
    assert predicted.rms == pytest.approx(missed, rel=1e-5)


def bounces(r, speed, seed):
    """Impact times of a ball that leaves the floor at a speed, with noise of 0.1 ms."""
    flights = 2 * speed / ij.BouncingBall().gravity.item() * r ** np.arange(9)
    times = 0.2 + np.concatenate([[0.0], np.cumsum(flights)])
    return times + 1e-4 * np.random.default_rng(seed).standard_normal(10)


def a_ball(times):
    record = ij.ImpactTimes(times)
    return ij.prepare(record, oscillator=ij.BouncingBall(), laws=["restitution"])


def test_another_recording_is_predicted_but_for_its_start():
    """At a fixed restitution impact times are linear in the first time and the first speed."""
    other = bounces(0.83, 3.0, seed=2)
    compared = ij.compare(a_ball(bounces(0.8, 2.0, seed=1)), holdout=a_ball(other))
    (fitted,) = compared
    r = float(fitted.estimate.value("r"))
    summed = np.concatenate([[0.0], np.cumsum(r ** np.arange(9))])
    rows = np.stack([np.ones(10), summed], axis=1)
    left = rows @ np.linalg.lstsq(rows, other)[0] - other
    assert fitted.prediction is not None
    assert fitted.prediction.observations == 10
    np.testing.assert_allclose(fitted.prediction.rms, np.sqrt(np.mean(left**2)), rtol=1e-6)
    assert fitted.prediction.rms > 5 * float(fitted.estimate.rms)
    said = next(each for each in sentences(compared.fits) if "held out" in each)
    assert said.startswith("recording was held out: nothing of the model was fitted to it.")
    assert document([compared])["fits"][0]["prediction"]["recording"] == "recording"
    worse = jnp.asarray(int(Outcome.WORSE_THAN_SPECIAL_CASE))
    failed = dataclasses.replace(fitted.estimate, outcome=worse)
    searches = ij.Starts(1), ij.LevenbergMarquardt(), Search()
    found = prediction_of_another(failed, a_ball(other), *searches)
    assert found == (10, np.inf, "recording")


def test_prior_knowledge_of_the_start_of_another_recording_is_kept():
    """At a given restitution and speed only the first time is fitted."""
    other, speed = bounces(0.83, 3.0, seed=2), 2.9
    held_out = ij.prepare(
        ij.ImpactTimes(other),
        oscillator=ij.BouncingBall(),
        laws=["restitution"],
        priors={"x_dot0": ij.Normal(speed, 1e-7), "r": ij.Normal(0.3, 1e-7)},
    )
    (fitted,) = ij.compare(a_ball(bounces(0.8, 2.0, seed=1)), holdout=held_out)
    r = float(fitted.estimate.value("r"))
    late = 2 * speed / 9.80665 * np.concatenate([[0.0], np.cumsum(r ** np.arange(9))]) - other
    assert fitted.prediction is not None
    np.testing.assert_allclose(fitted.prediction.rms, np.std(late), rtol=1e-5)


def swing(angle, seed):
    """A recorded pendulum on a stop, by SciPy, with a zero of its own."""
    ts, draw = np.arange(700) / 500, np.random.default_rng(seed)
    run = simulate_rigid(pendulum(13.47, 0.0017), [angle, 0.0], ts, lambda speed: 0.6)
    noise = np.radians(0.2) * draw.standard_normal(700)
    values = run.position + draw.normal(0.0, np.radians(0.1)) + noise
    return ij.prepare(
        ij.Recording(ts, values, ij.Angle()),
        laws=["restitution", "none"],
        fixed={"dry_friction": None, "gain": 1.0, "cutoff": np.inf},
    )


@thorough
def test_right_law_predicts_another_motion_within_its_noise():
    compared = ij.compare(swing(0.7, 1), starts=ij.Starts(4), holdout=swing(0.5, 2))
    assert [fit.is_free_flight for fit in compared] == [False, True]
    right, wrong = (fit.prediction for fit in compared)
    assert right is not None
    assert wrong is not None
    assert right.rms == pytest.approx(np.radians(0.2), rel=0.1)
    assert wrong.rms > 5 * right.rms


@quick
def test_recording_of_another_quantity_is_refused():
    with pytest.raises(ValueError, match="recording cannot be held out: it is a Recording in rad"):
        ij.compare(a_ball(bounces(0.8, 2.0, 1)), holdout=swing(0.5, 2))


@quick
@pytest.mark.parametrize(
    ("held_out", "says"),
    [
        ("1.5", "--holdout 1.5 must be a share from 0 to 0.9."),
        ("nan", "--holdout nan must be a share from 0 to 0.9."),
        (DATA, "is fitted itself: hold out another recording."),
        ("0,3", "0,3: "),
    ],
)
def test_what_cannot_be_held_out_is_refused_before_a_fit(held_out, says):
    run = command.impactjax("fit", DATA, "--law", "restitution", "--holdout", held_out)
    assert (run.status, run.stdout) == (2, "")
    (line,) = run.stderr.splitlines()
    assert says in line


@thorough
def test_command_predicts_another_recording(tmp_path):
    for name, seed in (("one", 1), ("two", 2)):
        times = "\n".join(f"{t:.6f}" for t in bounces(0.8, 2.0 + seed, seed))
        (tmp_path / f"{name}.csv").write_text(f"impact time [s]\n{times}\n")
    found = command.fitted(
        *(tmp_path / "out", tmp_path / "one.csv", "--law", "restitution"),
        *("--holdout", tmp_path / "two.csv"),
    )
    assert found.best["prediction"]["recording"].endswith("two.csv")
    assert found.best["prediction"]["n_samples"] == 10
    assert found.best["prediction"]["rms_residual"]["value"] == pytest.approx(1e-4, rel=0.5)
    assert "two.csv was held out" in found.page


@pytest.mark.parametrize("share", [-0.1, 1.0, np.nan])
def test_impossible_share_is_refused(share):
    with pytest.raises(ValueError, match="`holdout` is the share"):
        ij.compare({"line": experiment()}, holdout=share)


def test_too_few_fitted_observations_are_refused():
    with pytest.raises(ValueError, match="observation"):
        ij.compare({"line": experiment(np.arange(31) < 4)}, holdout=0.7)
