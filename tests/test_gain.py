"""The gain of a swing that is large enough to tell it, on records made with SciPy."""

import dataclasses

import numpy as np
import pytest

import impactjax as ij
from impactjax._fit.evaluation import evaluate
from impactjax._fit.fit import best_from
from impactjax._fit.search import Search
from impactjax._problem.build_problem import build_problem
from reference import pendulum, simulate_rigid

OMEGA_N, ZETA, R = 13.47, 0.0017, 0.6
TIMES = np.linspace(0.0, 1.4, 701)
NOISE = np.radians(0.2)
LARGE, SMALL = np.radians(45.0), np.radians(10.0)


def record(gain, angle, seed=0):
    flow = pendulum(OMEGA_N, ZETA)
    angles = simulate_rigid(flow, [angle, 0.0], TIMES, lambda speed: R).position
    noise = NOISE * np.random.default_rng(seed).standard_normal(TIMES.size)
    return ij.Recording(TIMES, gain * angles + noise, ij.Angle())


def errors_off(estimate, gain):
    """Distances of the estimates from the truth, in standard errors."""
    truth = {"omega_n": OMEGA_N, "r": R, "gain": gain}
    return {
        name: abs(estimate[name].value - value) / estimate[name].standard_error
        for name, value in truth.items()
        if name in estimate.names
    }


def test_wrong_gain_does_not_falsify_natural_frequency():
    gain = 1.08
    prepared = ij.prepare(record(gain, LARGE), laws=["restitution"])
    fitted = errors_off(ij.fit(prepared.experiment), gain)
    assert set(fitted) == {"omega_n", "r", "gain"}
    assert max(fitted.values()) < 3
    held = dataclasses.replace(prepared.experiment, free=("offset", "drift"))
    assert errors_off(ij.fit(held), gain)["omega_n"] > 3


@pytest.mark.parametrize(
    ("angle", "stated", "free"),
    [
        (LARGE, {}, {"offset", "drift", "gain", "cutoff"}),
        (SMALL, {}, {"offset", "drift", "cutoff"}),
        (LARGE, {"fixed": {"gain": 1.0}}, {"offset", "drift", "cutoff"}),
        (LARGE, {"sensor": ij.Sensor()}, set()),
        (LARGE, {"oscillator": ij.LinearOscillator(13.0)}, {"offset", "drift", "cutoff"}),
    ],
)
def test_gain_is_fitted_unless_stated_or_untold(angle, stated, free):
    record_ = record(1.0, angle)
    if "oscillator" in stated:
        record_ = ij.Recording(record_.ts, record_.values, ij.Displacement())
    prepared = ij.prepare(record_, laws=["restitution"], **stated)
    assert {*prepared.experiment.free} == free


def test_forecast_counts_the_fitted_gain():
    """The gain makes the initial angle uncertain, tens of times more than noise does."""
    recording = record(1.0, LARGE)
    told = ij.check(recording).forecasts
    fitted = ij.fit(ij.prepare(recording, laws=["restitution"]).experiment)
    assert told is not None
    errors = {each.name: each.error for each in told.motion}
    for name in ("omega_n", "r", "theta0"):
        assert errors[name] == pytest.approx(fitted[name].standard_error, rel=0.3)


def test_drift_moves_only_from_the_minimum_of_the_other_parameters():
    problem = build_problem(ij.prepare(record(1.0, SMALL), laws=["restitution"]).experiment)
    drift, tried = problem.names.index("drift"), []

    def seen(problem, u, parts, logs):
        tried.append(float(u[drift]))
        return evaluate(problem, u, parts, logs)

    lanes = ij.Starts(3).lanes(problem)
    estimate = best_from(problem, lanes, ij.LevenbergMarquardt(), Search(seen))
    first = next(i for i, each in enumerate(tried) if each != 0)
    assert 10 < first < len(tried) - 1
    assert abs(estimate["drift"].value) < 4 * estimate["drift"].standard_error
