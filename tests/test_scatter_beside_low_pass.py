"""Scatter from impact to impact beside a low-pass that may have no effect and is held."""

import dataclasses

import numpy as np
import pytest

import impactjax as ij
from impactjax._fit import scatter
from impactjax._fit.evaluation import evaluate
from impactjax._fit.linear_scatter import around, around_values, residuals_at
from impactjax._fit.scatter_summary import summarised
from impactjax._fit.scatter_test import with_normal_scatter
from impactjax._fit.search import Search
from impactjax._fit.straight import straight
from scattered_motions import experiment, plain, record


def test_search_may_begin_without_a_low_pass():
    sensor = ij.Sensor(low_pass=ij.Butterworth(40.0))
    own = experiment(record(1, 0.02), sensor=sensor, free=["cutoff"])
    problem = ij.build_problem(own).padded()
    axes = straight(problem)
    values, logs = axes.places(np.asarray(problem.starting_values())), np.zeros(16)
    values[list(axes.fades)] = [each.low for each in axes.ranges if each.fades]
    point, step = around(problem, values, logs, evaluate), 1e-6 * np.array(axes.fades)
    assert point.exists()
    moved = residuals_at(problem, values + step, logs, evaluate) - point.residuals
    np.testing.assert_allclose(point.jacobian @ step, moved, atol=0.01 * np.max(abs(moved)))


def test_linear_model_by_values_has_derivatives_by_values():
    sensor = ij.Sensor(low_pass=ij.Butterworth(40.0))
    problem = ij.build_problem(experiment(record(1, 0.02), sensor=sensor, free=["cutoff"]))
    values, logs = np.asarray(problem.starting_values()), np.zeros(16)
    point, step = around_values(problem, values, logs), 1e-6 * values
    places = straight(problem).places(values + step)
    padded = residuals_at(problem.padded(), places, logs, evaluate)
    moved = padded[: problem.valid.shape[-1]] - point.residuals
    np.testing.assert_allclose(point.jacobian @ step, moved, atol=0.01 * np.max(abs(moved)))


def filtered():
    """Estimate by a sensor with a low-pass that may have no effect."""
    sensor = ij.Sensor(low_pass=ij.Butterworth(40.0))
    found = ij.fit(experiment(record(1, 0.02), sensor=sensor, free=["cutoff"]))
    cutoff = np.array([name == "cutoff" for name in found.names])
    values = np.where(cutoff, 1e5, found.values)
    errors = np.where(cutoff, 1e7, found.standard_errors)  # so that it may be infinite
    return dataclasses.replace(found, values=values, standard_errors=errors)


def test_scatter_beside_a_held_cutoff_is_also_fitted_without_it(monkeypatch):
    begun, iterated = [], scatter._iterated

    def watched(problem, values, logs, held, evaluate):
        begun.append(values[list(straight(problem).fades)].item())
        return iterated(problem, values, logs, held, evaluate)

    monkeypatch.setattr(scatter, "_iterated", watched)
    with_normal_scatter(filtered(), Search())
    assert begun == pytest.approx([1e-5, 1e-12])


def test_held_parameter_does_not_enter_the_likelihood():
    before = plain(0.02)
    problem = before.problem.padded()
    held = np.array([name == "x_dot0" for name in before.names])
    assert held.any()
    at = np.asarray(before.values), np.zeros(16), held
    found = scatter._iterated(problem, *at, evaluate)
    assert found is not None
    jacobian = found.point.jacobian + held * np.arange(len(found.point.residuals))[:, None]
    other = found._replace(point=found.point._replace(jacobian=jacobian))
    one, two = (summarised(dataclasses.replace(before, problem=problem), x) for x in (found, other))
    assert float(one.aic) == pytest.approx(float(two.aic), abs=1e-6)
