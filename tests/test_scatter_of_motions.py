"""Restitution that scatters from impact to impact in a recorded motion, against a closed form."""

import dataclasses

import equinox as eqx
import numpy as np
import pytest

import impactjax as ij
from impactjax._compare import scattering
from impactjax._fit import scatter
from impactjax._fit.evaluation import evaluate
from impactjax._fit.linear_scatter import around
from impactjax._fit.scatter_score import linearised_with_scatter
from impactjax._fit.scatter_test import expected_fall
from impactjax._fit.search import Search
from impactjax._fit.straight import straight
from scattered_motions import (
    NOISE,
    OMEGA,
    SPEED,
    R,
    compared,
    drawn,
    experiment,
    holds,
    plain,
    record,
)
from tiers import quick, thorough


def test_scatter_is_found_and_its_intervals_hold():
    before = plain(0.02)
    assert not holds(before)
    (held,) = [each for each in ij.left_out(before) if each.name == "scatter"]
    assert held.is_needed
    assert held.value == pytest.approx(np.std(drawn(1, 0.02)), rel=0.3)
    after = ij.with_left_out(before, fixed=["offset", "drift", "gain"])
    assert after.converged
    assert holds(after)
    assert after.scatter is not None
    assert after.scatter.low < np.std(drawn(1, 0.02)) < after.scatter.high
    assert after.aic < before.aic - 10


def test_each_impact_has_its_deviation():
    found = compared().best.estimate
    assert found.scatter is not None
    told = np.asarray(found.scatter.logarithms)[:10] + np.log(found["r"].value)
    np.testing.assert_allclose(told, np.log(R) + drawn(1, 0.02)[:10], atol=3e-3)


def test_clean_record_asks_for_no_scatter():
    before = plain(0.0)
    assert all(each.name != "scatter" or not each.is_needed for each in ij.left_out(before))
    assert ij.with_left_out(before).scatter is None


def test_scatter_that_is_excluded_is_not_fitted():
    assert ij.with_left_out(plain(0.02), fixed=["scatter"]).scatter is None
    excluded = experiment(record(1, 0.02), scatter=ij.NoScatter())
    assert ij.compare({"own": excluded}, starts=ij.Starts(1)).best.estimate.scatter is None


def test_comparison_says_that_restitution_scatters():
    found = compared()
    assert found.best.estimate.scatter is not None
    assert holds(found.best.estimate)
    assert any("asks for scatter of restitution" in note for note in found.notes)


def test_scatter_of_a_comparison_is_saved(tmp_path):
    estimate, own = compared().best.estimate, experiment(record(1, 0.02))
    ij.io.save(tmp_path / "fit.npz", estimate)
    again = ij.io.load(tmp_path / "fit.npz", own)
    assert again.scatter is not None
    assert str(again) == str(estimate)
    excluded = dataclasses.replace(own, scatter=ij.NoScatter())
    with pytest.raises(ValueError, match="has scatter"):
        ij.io.load(tmp_path / "fit.npz", excluded)


def test_directional_derivatives_are_those_of_the_motion():
    """Around the truth an impact's factor changes all later flights in proportion."""
    problem = plain(0.0).problem.padded()
    values = straight(problem).places(np.array([SPEED, R, OMEGA]))
    values = np.array([{"r": R, "omega_n": OMEGA, "x_dot0": SPEED}[x] for x in problem.names])
    found = around(problem, values, np.zeros(12), evaluate)
    ts = np.asarray(problem.recording.instants)[:1200]
    number = np.floor(ts / (np.pi / OMEGA)).astype(int)
    shown = SPEED * R**number / OMEGA * np.abs(np.sin(OMEGA * ts))
    for impact in (0, 4, 10):
        np.testing.assert_allclose(
            found.effects[:1200, impact], np.where(number > impact, shown, 0.0), atol=1e-9
        )


def test_effect_of_a_held_parameter_is_that_of_generalised_least_squares():
    """With the covariance σ² I + s² A Aᵀ of noise and scatter, A in closed form."""
    found, ts = compared().best.estimate, record(1, 0.02).ts
    assert found.scatter is not None
    values = found.values
    speed, r, omega_n = (values[found.names.index(x)] for x in ("x_dot0", "r", "omega_n"))
    number = np.floor(ts / (np.pi / omega_n)).astype(int)
    factors = np.exp(np.append(0.0, found.scatter.logarithms))[: number[-1] + 1]
    speeds = speed * r**number * np.cumprod(factors)[number]
    shown = speeds / omega_n * abs(np.sin(omega_n * ts))
    effects = np.stack([np.where(number > i, shown, 0.0) for i in range(number[-1])], axis=1)
    covariance = found.rms**2 * np.eye(len(ts)) + found.scatter.size**2 * effects @ effects.T
    column = np.random.default_rng(2).standard_normal(len(ts))
    weighed = np.linalg.solve(covariance, np.column_stack([found.jacobian, column]))
    weighed, last = weighed[:, :-1], weighed[:, -1]
    expected = -np.linalg.solve(found.jacobian.T @ weighed, found.jacobian.T @ last)
    own = linearised_with_scatter(found, Search()).effect(column)
    np.testing.assert_allclose(own, expected, atol=1e-3 * np.max(np.abs(expected)))
    jacobian, information = found.scatter.jacobian, found.rms**2 * found.jacobian.T @ weighed
    told = np.diagonal(jacobian.T @ jacobian)
    np.testing.assert_allclose(told, np.diagonal(information), rtol=0.1)


def test_expected_fall_is_about_that_of_the_fit():
    expected = expected_fall(plain(0.02))
    assert expected > 10
    assert expected_fall(plain(0.0)) < 5


def test_scatter_compiles_no_further_simulation():
    evaluate._cached.clear_cache()  # pyright: ignore
    before = ij.fit(experiment(record(1, 0.02)))
    programs = evaluate._cached._cache_size()  # pyright: ignore
    ij.with_left_out(before, fixed=["offset", "drift", "gain"])
    ij.fit(experiment(record(1, 0.02), scatter=ij.NormalScatter()))
    assert evaluate._cached._cache_size() == programs  # pyright: ignore


def test_damping_at_the_end_of_its_range_stays_there():
    own = experiment(record(1, 0.02), fixed=["x0"], scatter=ij.NormalScatter())
    found = ij.fit(own)
    assert found.converged
    assert found["zeta"].value >= 0
    assert found["zeta"].low == 0
    assert found["zeta"].standard_error < found["zeta"].high < np.inf
    assert found.reason("zeta") is ij.Reason.OPEN_BELOW
    assert holds(found)


@pytest.mark.parametrize("noise", [1e-4, 1e-7])
def test_quiet_record_has_the_scatter_that_was_drawn(noise):
    """The noise is a hundredth to a hundred thousandth of the effects of the impacts."""
    found = ij.fit(experiment(record(3, 0.05, noise), scatter=ij.NormalScatter()))
    assert found.scatter is not None
    assert found.scatter.size == pytest.approx(np.std(drawn(3, 0.05), ddof=1), rel=0.15)
    assert holds(found)


def test_stated_noise_leaves_the_scatter_as_it_is():
    own = experiment(record(1, 0.02), scatter=ij.NormalScatter(), sensor=ij.Sensor(sigma=NOISE))
    stated, free = ij.fit(own).scatter, compared().best.estimate.scatter
    assert stated is not None
    assert free is not None
    assert float(stated.size) == pytest.approx(float(free.size), rel=0.05)
    assert float(stated.high) == pytest.approx(float(free.high), rel=0.1)


@thorough
def test_one_impact_tells_neither_restitution_nor_scatter():
    found = ij.fit(experiment(record(2, 0.01, count=150), scatter=ij.NormalScatter()))
    assert found.converged
    assert found.verdict("r") is ij.Verdict.NOT_IDENTIFIED
    assert "not told" in str(found)


@thorough
def test_fit_that_does_not_converge_stays_as_it_is():
    own = experiment(record(1, 0.02), scatter=ij.NormalScatter())
    found = ij.fit(dataclasses.replace(own, simulation=ij.Simulation(max_steps=4)))
    assert not found.converged


def test_scatter_that_does_not_settle_leaves_nothing_identified(monkeypatch):
    monkeypatch.setattr(scatter, "_MOST", 0)
    found = ij.compare({"own": experiment(record(1, 0.02))}, starts=ij.Starts(1))
    assert found.best.estimate.verdict("r") is ij.Verdict.NOT_IDENTIFIED
    assert any("did not settle, so that it identifies nothing" in note for note in found.notes)


@pytest.mark.parametrize(
    ("falls", "settled", "kept"),
    [((20, 15), True, True), ((20, 5), True, False), ((6, 3), True, True), ((20, 5), False, True)],
)
def test_change_must_stay_as_clear_beside_scatter(monkeypatch, falls, settled, kept):
    (fitted,) = compared()
    own = {fitted.name: experiment(record(1, 0.02))}

    def at(aic, **more):
        return fitted._replace(
            estimate=dataclasses.replace(fitted.estimate, aic=np.array(float(aic)), **more)
        )

    outcome = np.array(0 if settled else 6, np.int32)
    scattered = {0.0: at(-100.0, outcome=outcome), -falls[0]: at(-100.0 - falls[1])}
    monkeypatch.setattr(
        scattering,
        "assuming_scatter",
        lambda estimate, *_: scattered[float(estimate.aic)].estimate,
    )
    fits, more = ({fitted.name: at(aic)} for aic in (0.0, -falls[0]))
    assert scattering.explains_more(fits, more, own, Search()) is kept


@thorough
def test_impacts_without_a_factor_are_said():
    found = ij.fit(experiment(record(1, 0.02), scatter=ij.NormalScatter(), max_impacts=8))
    assert not found.converged
    assert "max_impacts" in found.cause


def test_law_that_is_wrong_is_not_taken_for_scatter():
    falling = record(1, 0.0, law=lambda speed: 0.95 - 0.02 * speed)
    found = ij.compare({"constant": experiment(falling)}, starts=ij.Starts(1))
    assert any("the law is wrong" in note for note in found.notes)
    assert not any("the law is wrong" in note for note in compared().notes)


@thorough
def test_compiled_fit_has_the_same_scatter():
    own = experiment(record(1, 0.02), scatter=ij.NormalScatter())
    one, other = eqx.filter_jit(ij.fit)(own), ij.fit(own)
    np.testing.assert_allclose(one.values, other.values, atol=1e-2 * other.standard_errors.min())
    assert one.scatter is not None
    assert other.scatter is not None
    np.testing.assert_allclose(one.scatter.size, other.scatter.size, rtol=1e-2)


@thorough
def test_coverage_where_restitution_scatters():
    held, sized = [], []
    for seed in range(24):
        found = ij.fit(experiment(record(seed, 0.01), scatter=ij.NormalScatter()))
        held.append(holds(found))
        assert found.scatter is not None
        sized.append(found.scatter.low < 0.01 < found.scatter.high)
    assert np.mean(held) >= 0.8
    assert np.mean(sized) >= 0.8


@quick
def test_scatter_needs_a_stop():
    model = ij.ImpactOscillator(ij.LinearOscillator(OMEGA, 0.0))
    own = dataclasses.replace(experiment(record(1, 0.0)), model=model, scatter=ij.NormalScatter())
    with pytest.raises(ValueError, match="needs a stop"):
        ij.build_problem(own)
