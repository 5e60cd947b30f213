"""Scatter from impact to impact that a fit did not assume: does the record ask for it?

The likelihood of the mixed model, linearised around the estimate without scatter, tells whether it
may; the fit with scatter decides.

Source: S. Greven and T. Kneib (2010), "On the behaviour of marginal and conditional AIC in linear
mixed models", Biometrika 97, 773, for the cost of a variance that may be zero.
"""

import dataclasses

import numpy as np
from scipy import special

from impactjax._fit.estimate import Estimate
from impactjax._fit.linear_scatter import around
from impactjax._fit.scatter import affected, with_scatter
from impactjax._fit.scatter_summary import likelihood
from impactjax._fit.score_test import HeldParameter
from impactjax._fit.search import Search
from impactjax._fit.straight import straight
from impactjax._known import known
from impactjax._problem.loss import Squares
from impactjax._problem.problem import Problem
from impactjax._problem.scatter import NormalScatter

_NAME, _UNIT = "scatter", "1"
_FEWEST = 2  # impacts that can differ
_FEW, _LEVEL = 5, 1e-3  # impacts that show a dependence on speed, and its level
_COUNTED = 2.0  # AIC counts the size of the scatter twice
_COST = 1.0  # cost of a size that may be zero: without scatter it gains nothing in half of records
_HOPELESS = -0.5  # expected fall of AIC below which the fit with scatter is not tried


def may_scatter(estimate: Estimate[Problem]) -> bool:
    """True for an estimate by least squares without scatter, of two impacts or more, all of which
    may have a factor.
    """
    problem = estimate.problem
    plain = isinstance(problem.loss, Squares) and estimate.scatter is None
    impacts = np.asarray(estimate.impacts.count)
    enough = bool(impacts >= _FEWEST) and bool(problem.all_have_factors(impacts))
    return plain and bool(estimate.converged) and enough


def expected_fall(estimate: Estimate[Problem], search: Search = Search()) -> float:
    """The fall of AIC by scatter, scaled to the independent observations, in linear approximation;
    −∞ if the residuals cannot be linearised.
    """
    problem = estimate.problem.padded()
    values = straight(problem).places(known(estimate.values))
    logs = np.zeros(affected(problem, estimate), values.dtype)
    point = around(problem, values, logs, search.evaluate)
    if not point.exists():
        return -np.inf
    steady = point._replace(effects=np.zeros_like(point.effects))
    gain = 2 * (likelihood(problem, point, logs) - likelihood(problem, steady, logs))
    return float(gain) * estimate.independent_observations / _count(estimate) - _COST


def with_normal_scatter(estimate: Estimate[Problem], search: Search) -> Estimate[Problem]:
    """The estimate with scatter, of one whose problem has none."""
    problem = dataclasses.replace(estimate.problem, scatter=NormalScatter())
    return with_scatter(dataclasses.replace(estimate, problem=problem), search)


def assuming_scatter(
    estimate: Estimate[Problem], search: Search = Search()
) -> Estimate[Problem] | None:
    """The estimate with scatter of an estimate that may have it; `None` if it is not likelier.

    One that did not settle is returned only if it is clearly likelier: then nothing is identified.
    """
    if not may_scatter(estimate) or expected_fall(estimate, search) < _HOPELESS:
        return None
    found = with_normal_scatter(estimate, search)
    return found if is_likely(estimate, found) else None


def is_likely(before: Estimate[Problem], after: Estimate[Problem]) -> bool:
    """True if scatter lowers AIC; clearly, if the fit with it did not settle."""
    held = as_held(before, after)
    return held.gain > 0 if bool(after.converged) else held.is_needed


def fall_of_aic(before: Estimate[Problem], after: Estimate[Problem]) -> float:
    """Fall of AIC by scatter, scaled to the independent observations."""
    share = after.independent_observations / _count(after)
    return (float(before.aic - after.aic) + _COUNTED) * share - _COST


def scatter_test(estimate: Estimate[Problem], search: Search = Search()) -> HeldParameter | None:
    """Scatter as a parameter that was left out; `None` if the record cannot tell of it."""
    found = assuming_scatter(estimate, search)
    return None if found is None else as_held(estimate, found)


def as_held(before: Estimate[Problem], after: Estimate[Problem]) -> HeldParameter:
    """Scatter as a parameter that was left out, from an estimate without and one with it."""
    scatter = after.scatter
    assert scatter is not None
    size, low, high = (float(x) for x in (scatter.size, scatter.low, scatter.high))
    error = (high - low) / 4  # half of a 95 % interval is two errors
    return HeldParameter(_NAME, _UNIT, 0.0, size, error, fall_of_aic(before, after))


def follows_speed(estimate: Estimate[Problem]) -> bool:
    """True if the deviations of the impacts depend on the approach speed: their correlation with
    its logarithm differs from zero at a level of 0.1 %. Then the law is wrong.
    """
    scatter, speeds = estimate.scatter, np.asarray(estimate.impacts.approach_speed)
    if scatter is None or not bool(estimate.usable):
        return False
    logs = np.asarray(scatter.logarithms)
    count = min(int(np.asarray(estimate.impacts.count)), len(logs), len(speeds))
    moving = (speeds[:count] > 0) & (logs[:count] != 0)
    if np.count_nonzero(moving) < _FEW or not float(scatter.low) > 0:
        return False
    correlation = np.corrcoef(np.log(speeds[:count][moving]), logs[:count][moving])[0, 1]
    freedom = np.count_nonzero(moving) - 2
    student = abs(correlation) * np.sqrt(freedom / (1 - correlation**2))
    return bool(student > special.stdtrit(freedom, 1 - _LEVEL / 2))


def _count(estimate: Estimate[Problem]) -> float:
    return float(np.asarray(estimate.problem.observations))
