"""Comparisons of repeated recordings, against the random-effects model of their results."""

import dataclasses
import json

import matplotlib.pyplot as plt
import numpy as np
import pytest

import impactjax as ij
from command import fitted, impactjax
from estimates import swing
from impactjax._fit.random_effects import random_effects
from impactjax._report.document import document
from impactjax._report.page import page

VALUES, ERRORS = (5.00, 5.06, 4.97), (0.01, 0.02, 0.01)
FOLDER = "runs"


def repeat(i: int, better: float = 20.0, *, converged: bool = True) -> ij.Comparison:
    """Two models on the i-th recording; the first is better by a difference of AIC."""
    estimate = swing()
    place = estimate.names.index("omega_n")
    values, errors = (np.array(getattr(estimate, name)) for name in ("values", "standard_errors"))
    values[place], errors[place] = VALUES[i], ERRORS[i]
    low, high = values - 2 * errors, values + 2 * errors
    own = dataclasses.replace(estimate, values=values, standard_errors=errors, low=low, high=high)
    values = values + 0.5
    other = dataclasses.replace(own, values=values, aic=own.aic + better)
    if not converged:
        other = dataclasses.replace(other, outcome=np.array(int(ij.Outcome.NOT_SIMULATED)))
    fits = ij.Fitted("first", own, 0.0), ij.Fitted("second", other, 0.0)
    return ij.Comparison(f"run {i + 1}", fits)


def repeats(better: float = 20.0) -> ij.Repeatability:
    return ij.repeatability([repeat(i, better) for i in range(3)])


def test_parameters_of_the_model_are_means_over_repeats():
    best = repeats().models[0]
    assert best.name == "first"
    assert {each.name for each in best.parameters} <= {"omega_n", "zeta", "r"}
    own = best["omega_n"]
    assert own.over == random_effects(np.array(VALUES), np.array(ERRORS))
    assert (own.low, own.high) == (own.over.low, own.over.high)
    np.testing.assert_array_equal([own.values, own.errors], [VALUES, ERRORS])


def test_criterion_is_summed_over_the_recordings():
    found = repeats()
    alone = ij.repeatability([repeat(0), repeat(1)])
    np.testing.assert_allclose(found["second"].behind / alone["second"].behind, 1.5)


def test_differing_results_are_said():
    found = repeats()
    assert found["first"]["omega_n"].differs
    assert "omega_n of first differs between repeats by more than the errors." in found.notes
    assert "omega_n = 5.00" in str(found)


def test_interval_is_across_models_that_all_recordings_cannot_distinguish():
    alone, wide = repeats()["first"]["omega_n"], repeats(0.1)["first"]["omega_n"]
    assert wide.high > alone.high + 0.3
    assert wide.low == alone.low


def test_recording_that_does_not_determine_a_parameter_is_left_out():
    first = repeat(0)
    estimate = first[0].estimate
    errors = np.array(estimate.standard_errors)
    errors[estimate.names.index("omega_n")] = np.inf
    blunt = first[0]._replace(estimate=dataclasses.replace(estimate, standard_errors=errors))
    changed = dataclasses.replace(first, fits=(blunt,))
    own = ij.repeatability([changed, repeat(1), repeat(2)])["first"]["omega_n"]
    assert own.over == random_effects(np.array(VALUES[1:]), np.array(ERRORS[1:]))
    assert np.isnan(own.values[0])
    pair = ij.repeatability([changed, repeat(1)])["first"]
    with pytest.raises(KeyError, match="`omega_n` has no mean over repeats"):
        pair["omega_n"]


def test_model_without_a_result_for_all_is_left_out_with_a_sentence():
    found = ij.repeatability([repeat(0), repeat(1, converged=False)])
    assert [each.name for each in found.models] == ["first"]
    assert "second has no result for run 2." in found.notes
    with pytest.raises(KeyError, match="`second` was not fitted to all recordings"):
        found["second"]
    first, second = repeat(0), repeat(1)
    plain = [
        dataclasses.replace(first, fits=first.fits[:1]),
        dataclasses.replace(second, fits=second.fits[1:]),
    ]
    nothing = ij.repeatability(plain)
    assert nothing.models == ()
    assert nothing.notes[0].startswith("No model has a result for all recordings")
    assert "All recordings together" in page(nothing.comparisons, "", nothing)


def test_report_and_json_hold_the_means(tmp_path):
    found = repeats()
    ij.io.write_report(tmp_path, found)
    written = json.loads((tmp_path / "fit.json").read_text())["repeatability"]
    assert written["recordings"] == ["run 1", "run 2", "run 3"]
    own = written["models"][0]["parameters"]["omega_n"]
    np.testing.assert_allclose(own["values"], VALUES)
    np.testing.assert_allclose(own["value"], found["first"]["omega_n"].over.mean)
    text = (tmp_path / "report.html").read_text()
    assert text.index("All recordings together") < text.index("Laws compared")
    assert document(found.comparisons)["repeatability"] is None


def test_figure_shows_results_and_their_mean():
    parameter = repeats()["first"]["omega_n"]
    ax = ij.plot.repeats(plt.figure().subplots(), parameter)
    (points,) = [line for line in ax.lines if line.get_marker() == "o"]
    np.testing.assert_array_equal(points.get_ydata(), VALUES)
    assert ax.get_ylabel() == "omega_n [rad/s]"


def test_single_repeats_stay_in_the_range():
    firsts = []
    for i, value in enumerate((0.999, 0.9995, 0.98)):
        fitted = repeat(i).fits[0]
        estimate, place = fitted.estimate, fitted.estimate.names.index("zeta")
        values, errors = (np.array(getattr(estimate, x)) for x in ("values", "standard_errors"))
        values[place], errors[place] = 1e-3 * (1 - value), 1e-3
        own = dataclasses.replace(estimate, values=values, standard_errors=errors)
        firsts.append(ij.Comparison(f"run {i}", (fitted._replace(estimate=own),)))
    zeta = ij.repeatability(firsts)["first"]["zeta"]
    assert zeta.low == zeta.over.single_low == 0


def test_one_comparison_is_refused():
    with pytest.raises(ValueError, match="at least two recordings"):
        ij.repeatability([repeat(0)])
    with pytest.raises(TypeError, match="comparisons"):
        ij.repeatability([repeat(0), swing()])  # pyright: ignore[reportArgumentType]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder with three recordings of a bouncing ball whose restitution differs, by the closed
    form of its flights, and their sidecar.
    """
    folder, rng = tmp_path_factory.mktemp("folder") / FOLDER, np.random.default_rng(2)
    folder.mkdir()
    (folder / ".hidden").write_text("no recording")
    (folder / "run1.toml").write_text("[fixed]\ngravity = 9.80665\n")
    for i, r in enumerate((0.80, 0.82, 0.81)):
        flights = 2 * 3.0 * r ** np.arange(10) / 9.80665
        times = np.concatenate([[0.0], np.cumsum(flights)]) + 1e-4 * rng.standard_normal(11)
        lines = ["impact time [s]", *(f"{time:.6f}" for time in times)]
        (folder / f"run{i + 1}.csv").write_text("\n".join(lines))
    return folder


def test_folder_is_fitted_together(runs, tmp_path):
    found = fitted(tmp_path, runs, "--law", "restitution", "--together")
    assert "all recordings together" in found.stdout
    own = found.document["repeatability"]["models"][0]["parameters"]["r"]
    np.testing.assert_allclose(own["values"], [0.80, 0.82, 0.81], atol=1e-3)
    low, high = own["interval95"]
    assert low < 0.80 < 0.82 < high
    np.testing.assert_allclose(own["between"], 0.01, rtol=0.4)


def test_folder_without_recordings_and_a_single_recording_are_refused(runs, tmp_path):
    run = impactjax("fit", tmp_path)
    assert (run.status, "has no file in it" in run.stderr) == (2, True)
    run = impactjax("fit", runs / "run1.csv", "--together")
    assert (run.status, "at least two recordings" in run.stderr) == (2, True)
    again = runs / ".." / FOLDER / "run1.csv"
    run = impactjax("fit", runs / "run1.csv", again, "--together")
    assert (run.status, "at least two recordings" in run.stderr) == (2, True)
    run = impactjax("fit", tmp_path / "none.csv", "--together")
    assert (run.status, "none.csv" in run.stderr) == (2, True)


def test_report_of_nothing_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no comparison to report"):
        ij.io.write_report(tmp_path, [])
    with pytest.raises(TypeError, match="results"):
        ij.io.write_report(tmp_path, repeats().models)  # pyright: ignore[reportArgumentType]
