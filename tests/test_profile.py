"""Profiles of problems whose sum of squares is known in closed form, and of some that fail."""

import dataclasses
import math

import numpy as np
import pytest

import impactjax as ij
from estimates import line
from impactjax._fit.profile import profiled_by
from impactjax._fit.profile_walk import Walk
from impactjax._fit.search import Search
from tiers import quick

pytestmark = quick


def failing_beyond(distance, name="x_dot0", side=1):
    """A search in which nothing can be simulated beyond so many standard errors."""
    _, found = line()
    at = found.names.index(name)
    centre, error = float(found.values[at]), float(found.standard_errors[at])

    def failed(searches, model):
        held = ~searches.active[:, at]
        far = held & (side * (searches.starts[:, at] - centre) > distance * error)
        return model._replace(cost=np.where(far, np.inf, model.cost))

    class Failing(Search):
        def linearised(self, problem, searches):
            return failed(searches, Search().linearised(problem, searches))

        def minima(self, problem, optimiser, searches):
            found = Search().minima(problem, optimiser, searches)
            return found._replace(model=failed(searches, found.model))

    return profiled_by(Failing(), found), at


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("distance", [0.0, 0.3, 1.7])
def test_failing_profile_bounds_nothing(distance, side):
    found, at = failing_beyond(distance, side=side)
    _, whole = line()
    assert found.verdict("x_dot0") is ij.Verdict.UNDECIDED
    assert found.verdict("x0") is ij.Verdict.IDENTIFIED
    ends = {-1: found.low, 1: found.high}
    known = {-1: whole.low, 1: whole.high}
    assert math.isnan(float(ends[side][at]))
    np.testing.assert_allclose(ends[-side][at], known[-side][at], rtol=1e-6)
    assert "± " in found.quoted("x_dot0")
    assert "(undecided)" in str(found)


def test_profile_limit_before_failure_is_found():
    found, at = failing_beyond(2.06)  # the limit is 2.045, Student's with 29 degrees of freedom
    _, whole = line()
    assert found.verdict("x_dot0") is ij.Verdict.IDENTIFIED
    half = float(whole.high[at] - whole.values[at])
    np.testing.assert_allclose(found.high[at], whole.high[at], atol=0.02 * half)


def test_profile_approaches_failure_beyond_first_step():
    found, _ = failing_beyond(3.0)
    assert found.verdict("x_dot0") is ij.Verdict.IDENTIFIED


def test_profile_side_is_open_despite_distant_failure():

    walk = Walk(0, 1, 1.0, 1.0, logarithmic=True, farthest=math.inf, limit=2.0)
    while not walk.done:
        walk.learn(0.1 if walk.next_value() < math.exp(12) else math.nan)
    assert not walk.failed
    assert walk.end(math.inf) == math.inf


def test_standard_errors_agree_with_profile():
    """Errors that are twice what they should be, of a line with the errors of the textbook."""
    _, found = line()
    wrong = dataclasses.replace(
        found, standard_errors=2 * found.standard_errors, covariance=4 * found.covariance
    )
    profile = ij.profiled(wrong)
    np.testing.assert_allclose(profile.standard_errors, found.standard_errors, rtol=1e-2)
    np.testing.assert_allclose(profile.covariance, found.covariance, rtol=2e-2)
    np.testing.assert_array_equal(ij.profiled(found).standard_errors, found.standard_errors)
