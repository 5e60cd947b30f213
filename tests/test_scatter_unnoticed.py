"""Scatter from impact to impact that a recorded motion does not show, and the intervals that allow
for it.
"""

import numpy as np
import pytest
from scipy import stats

import impactjax as ij
from impactjax._compare.fit_models import _is_worse
from impactjax._fit.evaluation import evaluate
from impactjax._fit.scatter_test import with_normal_scatter
from impactjax._fit.search import Search
from scattered_motions import OMEGA, R, experiment, plain, record
from tiers import thorough

STARTS = ij.Starts(1)
LINE = ij.LinearRestitution(R, 1e-3)


def best(recording, **more):
    own = experiment(recording, **{"contact": LINE, **more})
    found = ij.compare({"own": own}, starts=STARTS)
    return found, found.best.estimate


@thorough
@pytest.mark.parametrize("seed", [7, 10, 15, 30])
def test_slope_of_restitution_is_covered(seed):
    """Five impacts of a constant restitution with a scatter of 0.4 %, fitted with r0 - alpha v. The
    slope takes the scatter up.
    """
    recording = record(seed, 0.004, noise=4e-3, count=550)
    plain = ij.profiled(ij.fit(experiment(recording, contact=LINE)))
    assert not plain["alpha"].low < 0 < plain["alpha"].high
    found, wider = best(recording)
    assert any(note.startswith("The record does not ask for scatter") for note in found.notes)
    assert wider["alpha"].low < 0 < wider["alpha"].high
    assert wider["r0"].low < R < wider["r0"].high
    assert wider.verdict("alpha") is ij.Verdict.IDENTIFIED


def test_intervals_hold_those_with_and_without_scatter():
    """Some ends lie further out without scatter, those of restitution with it."""
    recording = record(1, 0.0, count=550)
    _, wider = best(recording)
    plain = ij.profiled(ij.fit(experiment(recording, contact=LINE)))
    scattered = ij.fit(experiment(recording, contact=LINE, scatter=ij.NormalScatter()))
    assert wider.scatter is None
    size = 0.01 * float(np.min(plain.high - plain.low))
    np.testing.assert_allclose(wider.low, np.minimum(plain.low, scattered.low), atol=size)
    np.testing.assert_allclose(wider.high, np.maximum(plain.high, scattered.high), atol=size)
    assert np.any(wider.low < scattered.low - size)
    assert np.any(wider.low < plain.low - size)
    halves = np.asarray(wider.high - wider.low) / 2 / stats.t.ppf(0.975, float(plain.freedom))
    expected = np.maximum(plain.standard_errors, halves)
    np.testing.assert_allclose(wider.standard_errors, expected, rtol=1e-6)
    assert np.any(expected > 1.1 * np.asarray(plain.standard_errors))
    assert float(wider.aic) == pytest.approx(float(plain.aic))


def test_three_impacts_do_not_widen_intervals():
    recording = record(1, 0.0, count=int(3.5 * np.pi / OMEGA * 400))
    found, estimate = best(recording, contact=ij.Restitution(R))
    assert int(estimate.impacts.count) == 3
    assert estimate.scatter is None
    assert not any("scatter" in note for note in found.notes)


def test_excluded_scatter_leaves_intervals_as_they_are():
    own = experiment(record(1, 0.0), scatter=ij.NoScatter())
    estimate = ij.compare({"own": own}, starts=STARTS).best.estimate
    plain = ij.profiled(ij.fit(own))
    np.testing.assert_allclose(estimate.high - estimate.low, plain.high - plain.low, rtol=1e-6)


@thorough
def test_scatter_that_is_not_decided_narrows_no_interval():
    """With scatter the damping ends at zero, and the others are as if it were known."""
    recording = record(1, 0.0, count=int(4.5 * np.pi / OMEGA * 400))
    found, estimate = best(recording, fixed=["x0"])
    plain = ij.profiled(ij.fit(experiment(recording, contact=LINE, fixed=["x0"])))
    assert any("scatters from impact to impact is not decided" in x for x in found.notes)
    assert estimate.scatter is not None
    assert np.all(estimate.high - estimate.low > 0.999 * (plain.high - plain.low))


@thorough
def test_least_stiffness_of_a_rigid_stop_is_told_beside_scatter():
    """In linear approximation the record tells of the inverse, and nothing of the frequency."""
    recording = record(3, 0.0)
    more = {"contact": ij.KelvinVoigt(4000.0, 0.0335), "max_steps": 512}
    plain = ij.profiled(ij.fit(experiment(recording, **more)))
    found, wider = best(recording, **more)
    assert any(note.startswith("The record does not ask for scatter") for note in found.notes)
    assert 0.9 * plain["omega0"].low < wider["omega0"].low <= plain["omega0"].low
    assert wider.verdict("omega0") == plain.verdict("omega0")
    widths = [each["gamma"].high - each["gamma"].low for each in (plain, wider)]
    assert widths[1] > 1.5 * widths[0]


def test_model_that_misses_the_record_identifies_nothing():
    """The natural frequency is stated wrong by 0.7 %."""
    fixed = {"x0": 0.0, "zeta": 0.0, "omega_n": 12.08}
    _, estimate = best(record(1, 0.0, count=480), contact=ij.Restitution(R), fixed=fixed)
    assert float(estimate.misfit) > 0
    assert estimate.verdict("r") is ij.Verdict.NOT_IDENTIFIED


def test_model_with_scatter_is_no_special_case_of_one_without():
    """Its residuals are smaller, as those after the deviations of each impact."""
    plain = ij.fit(experiment(record(1, 0.02)))
    scattered = ij.fit(experiment(record(1, 0.02), scatter=ij.NormalScatter()))
    assert scattered.rms < plain.rms
    assert not _is_worse(plain, scattered)
    assert not _is_worse(scattered, plain)


def test_search_for_scatter_of_a_motion_without_any_ends_when_it_has_settled():
    """Twelve evaluations a round: one for each impact and one for the values."""
    calls = []

    def counted(*arguments):
        calls.append(1)
        return evaluate(*arguments)

    found = with_normal_scatter(plain(0.0), Search(counted))
    assert bool(found.converged)
    assert len(calls) < 6 * 12
