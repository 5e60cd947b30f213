"""Estimate from the mixed model of scatter: values, intervals, and the size of the scatter."""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from impactjax._fit.estimate import Estimate
from impactjax._fit.linear_scatter import (
    Around,
    Effects,
    Mask,
    Step,
    Vector,
    counted,
    in_units_of_noise,
)
from impactjax._fit.marginal_likelihood import marginal_likelihood
from impactjax._fit.mixed_model import Observed, OwnNoise, whitened
from impactjax._fit.scatter_found import Scatter
from impactjax._fit.straight import straight
from impactjax._fit.uncertainty import holding_both, verdicts, within_ranges
from impactjax._known import AnyArray, known, namespace
from impactjax._outcome import Outcome
from impactjax._problem.problem import Problem

_SETTLED = 0.1  # move of a value by one more step, relative to its error
_ROUNDING = 1e-8  # move that a simulation cannot resolve, relative to the value
_ALIKE = 3.84  # difference of twice the log-likelihood that does not decide, chi-squared at 95 %


class Solution(NamedTuple):
    """Point at which an iteration ended.

    - `values`: straight coordinates of the parameters.
    - `logs`: logarithms of the factors.
    - `point`: linear model around them.
    - `step`: one more step, with the mixed model.
    - `held`: mask of the parameters that kept their values.
    """

    values: Vector
    logs: Effects
    point: Around
    step: Step
    held: Mask


class _Found(NamedTuple):
    """The answer of a mixed model, in straight coordinates."""

    values: Vector
    low: Vector
    high: Vector
    covariance: Float[AnyArray, "parameters parameters"]
    freedom: AnyArray
    scatter: Scatter
    likelihood: AnyArray
    settled: AnyArray
    determined: Bool[AnyArray, " parameters"]
    held: Mask


def summarised(estimate: Estimate[Problem], solution: Solution) -> Estimate[Problem]:
    """The estimate at a solution, from one without scatter. A parameter that was held keeps its
    error and an interval that holds its value.
    """
    found, problem = _found(estimate.problem, solution), estimate.problem
    if problem.recording.observes_impacts:
        noise = solution.step.model.noise
        estimate = dataclasses.replace(estimate, problem=problem.weighed(noise))
    return _estimate(estimate, found, solution.point)


def _found(problem: Problem, solution: Solution) -> _Found:
    values, logs, point, step, held = solution
    model = step.model
    xp, stopped = namespace(values), namespace(values).diag(step.stopped)
    covariance = xp.where(stopped, step.unlimited.covariance, model.covariance)
    enough = _SETTLED * xp.sqrt(xp.diagonal(model.covariance)) + _ROUNDING * xp.abs(values)
    settled = xp.all((xp.abs(step.move) <= enough) | ~model.determined)
    middle = values + xp.where(settled, step.move, 0.0)
    low, high = (middle + _reach(step, level) for level in (0.025, 0.975))
    determined = xp.where(step.stopped, step.unlimited.determined, model.determined)
    unbounded = xp.where(determined, 0.0, np.inf)
    size, least, most = (model.size(level) for level in (0.5, 0.025, 0.975))
    slopes = straight(problem).slopes(straight(problem).values(values))
    squares = xp.sum(known(point.residuals) ** 2)
    unit = squares / counted(problem, squares) if in_units_of_noise(problem) else 1.0
    jacobian = whitened(point.jacobian / slopes, point.effects, model.ratio / unit)
    return _Found(
        values,
        low - unbounded,
        high + unbounded,
        covariance,
        model.freedom,
        Scatter(size, least, most, model.effect, jacobian),
        likelihood(problem, point.without(held), logs),
        settled,
        determined,
        held,
    )


def _reach(step: Step, level: float) -> Vector:
    """Distances of quantiles from the values; those of a parameter at an end of its range are those
    of the solution without ranges.
    """
    xp, model, unlimited = namespace(step.move), step.model, step.unlimited
    beyond = unlimited.quantile(level) - unlimited.value
    return xp.where(step.stopped, beyond, model.quantile(level) - model.value)


def likelihood(problem: Problem, point: Around, logs: Effects) -> AnyArray:
    """The largest log-likelihood of the linear model with scatter, for independent noise."""
    observed = point.effects @ logs - point.residuals
    count, variance = counted(problem, observed), problem.variance()
    known_variance = None if variance is None else known(variance)
    none = OwnNoise(0 * count, 0 * count)
    data = Observed(observed, point.jacobian, point.effects, count, none)
    return marginal_likelihood(data, known_variance, point.prior)


def _ratio(errors: Vector, before: Vector) -> Vector:
    """Ratio of errors; 1 where one of them is infinite."""
    xp = namespace(errors, before)
    both = xp.isfinite(errors) & xp.isfinite(before) & (before > 0)
    return xp.where(both, errors / xp.where(both, before, 1.0), 1.0)


@np.errstate(all="ignore")
def _estimate(estimate: Estimate[Problem], found: _Found, point: Around) -> Estimate[Problem]:
    """The estimate with the values, intervals and residuals of a mixed model."""
    own, (estimate, found, point) = estimate.problem, known((estimate, found, point))
    problem, residuals, xp = estimate.problem, point.residuals, namespace(estimate, point)
    n = counted(problem, residuals)
    missed = problem.misfit(residuals)
    settled = found.settled & xp.all(xp.isfinite(residuals))
    whole = problem.all_have_factors(point.impacts.count)
    failure = xp.where(whole, Outcome.SCATTER_UNSETTLED, Outcome.SCATTER_BEYOND)
    outcome = xp.where(estimate.converged & ~(settled & whole), failure, estimate.outcome)
    outcome = outcome.astype(np.int32)
    usable = (outcome == Outcome.CONVERGED) & (missed == 0)
    lasting = problem.noise.lasts(residuals, n)
    exceeds_noise = problem.exceeds_noise(residuals, point.impacts)
    doubtful = lasting | exceeds_noise
    axes = straight(problem)
    values, (low, high) = axes.values(found.values), axes.interval(found.low, found.high)
    slopes = axes.slopes(values)
    low, high = (
        xp.where(found.held, old, new) for old, new in ((estimate.low, low), (estimate.high, high))
    )
    interval = within_ranges(problem, low, high)
    infinite = xp.diag(xp.where(found.determined, 0.0, xp.inf))
    covariance = found.covariance * xp.outer(slopes, slopes) + infinite
    errors = xp.sqrt(xp.diagonal(covariance))
    errors = xp.where(found.held, estimate.standard_errors, errors)
    parameters = len(problem.names) + 1 + problem.sizes_found
    return dataclasses.replace(
        estimate,
        problem=own,
        values=values,
        standard_errors=errors,
        inflation=estimate.inflation * _ratio(errors, estimate.standard_errors),
        freedom=found.freedom,
        memory=problem.noise.order(residuals, n),
        low=interval.low,
        high=interval.high,
        covariance=covariance,
        lasting=lasting,
        exceeds_noise=exceeds_noise,
        verdicts=verdicts(interval.below & usable, interval.above & usable, doubtful),
        residuals=residuals,
        jacobian=point.jacobian / slopes,
        impacts=point.impacts,
        rms=xp.sqrt(xp.sum(residuals**2) / n),
        aic=2 * parameters - 2 * found.likelihood,
        bic=xp.log(n) * parameters - 2 * found.likelihood,
        misfit=missed,
        outcome=outcome,
        scatter=found.scatter,
    )


def likelier(one: Estimate[Problem], other: Estimate[Problem]) -> Estimate[Problem]:
    """The likelier of two estimates of one problem. Its intervals hold both if twice the
    log-likelihoods differ by less than 3.84, scaled to the independent observations.
    """
    usable = [each for each in (one, other) if bool(each.usable)]
    if len(usable) < 2:
        return usable[0] if usable else one
    best, second = sorted(usable, key=lambda each: float(each.aic))
    share = best.independent_observations / float(best.problem.observations)
    if share * float(second.aic - best.aic) > _ALIKE:
        return best
    return holding_both(best, second)
