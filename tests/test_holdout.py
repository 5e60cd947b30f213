"""Predictions of the end of a record, against a straight line by NumPy."""

import dataclasses
import json

import numpy as np
import pytest

import impactjax as ij
from estimates import SMALL, TS
from impactjax._compare.holdout import fitted_part, prediction
from impactjax._fit.search import Search
from impactjax._report.document import document
from impactjax._report.page import page
from impactjax._report.words import sentences

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
    predicted = prediction(found, own.recording, ij.LevenbergMarquardt(), Search())
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
    predicted = prediction(found, own.recording, ij.LevenbergMarquardt(), Search())
    fitted = times + np.asarray(found.residuals)
    flight = fitted[10] - fitted[9]
    expected = fitted[10] + np.cumsum(flight * float(found.value("r")) ** np.arange(1, 4))
    missed = np.sqrt(np.mean((expected - times[11:]) ** 2))
    assert predicted.observations == 3
    assert predicted.rms == pytest.approx(missed, rel=1e-5)


@pytest.mark.parametrize("share", [-0.1, 1.0, np.nan])
def test_impossible_share_is_refused(share):
    with pytest.raises(ValueError, match="`holdout` is the share"):
        ij.compare({"line": experiment()}, holdout=share)


def test_too_few_fitted_observations_are_refused():
    with pytest.raises(ValueError, match="observation"):
        ij.compare({"line": experiment(np.arange(31) < 4)}, holdout=0.7)
