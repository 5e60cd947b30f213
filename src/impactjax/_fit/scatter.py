"""Restitution that scatters from impact to impact: the fit of its size and of the mean law.

The speed after impact i is that of the law times exp(s ξᵢ), with standard normal ξᵢ. Around a point
(p, u) with uᵢ = s ξᵢ the residuals are linear in both, which is a linear mixed model. Its solution
is the next point.

Source: M. J. Lindstrom and D. M. Bates (1990), "Nonlinear mixed effects models for repeated
measures data", Biometrics 46, 673, for the alternation of both steps.
"""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from impactjax._fit.estimate import Estimate
from impactjax._fit.mixed_model import (
    MixedModel,
    OwnNoise,
    marginal_likelihood,
    mixed_model,
    whitened,
)
from impactjax._fit.scatter_found import Scatter
from impactjax._fit.search import Search
from impactjax._fit.straight import Straight, straight
from impactjax._fit.uncertainty import verdicts, within_ranges
from impactjax._known import AnyArray, is_known, known, namespace
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._outcome import Outcome
from impactjax._problem.padding import padded_size
from impactjax._problem.problem import Problem
from impactjax._simulate.impact_log import ImpactLog

_ROUNDS = 4  # linearisations
_SHARES = (1.0, 0.5, 0.1, 0.01)  # of a linearisation, tried in turn
_SETTLED = 0.1  # move of a value by the last linearisation, relative to its error
_ROUNDING = 1e-8  # move that a simulation cannot resolve, relative to the value
_CLEARLY = 2.0  # distance from no effect, in errors, at which a parameter that fades is fitted
_CERTAIN = 1e8  # degrees of freedom that stand for a known variance
_LOST = 1e-10  # relative singular value of a direction without information

Vector = Float[AnyArray, " parameters"]
Mask = Bool[AnyArray, " parameters"]
Effects = Float[AnyArray, " impacts"]


class _Around(NamedTuple):
    """Residuals around a point: simulated minus recorded, and their derivatives by straight
    coordinates.
    """

    residuals: Float[AnyArray, " observations"]
    jacobian: Float[AnyArray, "observations parameters"]
    effects: Float[AnyArray, "observations impacts"]  # derivatives by the logarithms of the factors
    impacts: ImpactLog


def with_scatter(
    estimate: Estimate[Problem], optimiser: LevenbergMarquardt, search: Search = Search()
) -> Estimate[Problem]:
    """The estimate with scatter from impact to impact, from one without.

    Works under `jit` and `vmap`. It has converged if the one without scatter had, and if the last
    linearisation moves no value by more than a tenth of its error, or by more than rounding. A
    linearisation that leads to a motion that does not exist is followed part of the way.
    """
    own = estimate.problem
    problem = own.padded() if is_known(own) else own
    traced = not is_known((problem, estimate.values))
    axes = straight(problem)
    values = axes.turned(estimate.values if traced else known(estimate.values))
    errors = estimate.standard_errors if traced else known(estimate.standard_errors)
    held = _held(axes, values, errors)
    logs = namespace(values).zeros(_impacts(problem, estimate), values.dtype)
    parts, yes = jnp.asarray(problem.parts(optimiser.horizons)), jnp.ones((), bool)

    def around(values: Vector, logs: Effects) -> _Around:
        scattered, own = problem.scattered(jnp.exp(jnp.asarray(logs))), axes.turned(values)
        u = jnp.asarray(problem.coordinates(own))
        answer = search.evaluate(scattered, u, parts, yes).answer
        assert answer.jacobian is not None
        assert answer.effects is not None
        jacobian = namespace(values).where(held, 0.0, answer.jacobian * axes.slopes(own))
        point = _Around(answer.residuals, jacobian, answer.effects, answer.impacts)
        return point if traced else known(point)

    point = around(values, logs)
    for _ in range(_ROUNDS):
        solution = _solved(problem, point, logs)
        for share in _SHARES[:1] if traced else _SHARES:
            moved = _within(problem, values + share * solution.value)
            effects = logs + share * (solution.effect - logs)
            there = around(moved, effects)
            if traced or _exists(there):
                values, logs, point = moved, effects, there
                break
    found = _found(problem, values, logs, point, own.valid.shape[-1])
    longer = dataclasses.replace(estimate, problem=problem, scatter=None)
    return _estimate(longer, problem, *jax.tree.map(jnp.asarray, (found, point))).of(own)


def _held(axes: Straight, values: Vector, errors: Vector) -> Mask:
    """Mask of the parameters that fade and may have no effect: the residuals are not linear in
    them, so that they keep their values. The errors are those of the parameters themselves.
    """
    own = errors / abs(axes.slopes(axes.turned(values)))
    return namespace(values).asarray(axes.fades) & ~(values > _CLEARLY * own)


def _exists(point: _Around) -> bool:
    numbers = point.residuals, point.jacobian, point.effects
    return all(bool(np.all(np.isfinite(np.asarray(each)))) for each in numbers)


def _impacts(problem: Problem, estimate: Estimate[Problem]) -> int:
    """Number of impacts that may scatter; at least those of the fitted motion."""
    if problem.recording.observes_impacts:
        return problem.valid.shape[-1] - 1
    most = estimate.impacts.time.shape[-1]
    count = estimate.impacts.count
    return min(padded_size(int(count)), most) if is_known(count) else most


def _solved(problem: Problem, point: _Around, logs: Effects) -> MixedModel:
    """The mixed model around a point, in changes of the parameters."""
    observed = point.effects @ logs - point.residuals
    variance = problem.variance()
    if variance is None and not problem.recording.observes_impacts:
        return mixed_model(*_whitened(problem, observed, point))
    zero = namespace(observed).zeros_like(observed[0])
    own = OwnNoise(zero, zero)
    if variance is not None:
        own = OwnNoise(zero + _CERTAIN, _CERTAIN * known(variance))
    return mixed_model(observed, point.jacobian, point.effects, _count(problem, observed), own)


def _count(problem: Problem, like: AnyArray) -> AnyArray:
    return namespace(like).sum(known(problem.valid)).astype(like.dtype)


@eqx.filter_jit
def _whitened(
    problem: Problem, observed: AnyArray, point: _Around
) -> tuple[AnyArray, AnyArray, AnyArray, AnyArray, OwnNoise]:
    """A recorded motion along the directions of parameters and scatter, in units of its noise.

    The noise model of the problem gives the covariance of the noise along these directions, from
    the residuals that lie in none of them.
    """
    both = jnp.concatenate([point.jacobian, point.effects], axis=1)
    norms = jnp.linalg.norm(both, axis=0)
    axes, lengths, _ = jnp.linalg.svd(both / jnp.where(norms > 0, norms, 1.0), full_matrices=False)
    felt = lengths > _LOST * jnp.max(lengths)
    axes = jnp.where(felt, axes, 0.0)
    rest = observed - axes @ (axes.T @ observed)
    count, p = _count(problem, observed), jnp.sum(felt.astype(observed.dtype))
    size = jnp.sum(rest**2) / count
    spread = problem.noise.spread(rest, count, axes)
    kappa = jnp.trace(spread) / (p * size)
    freedom = jnp.maximum(count / jnp.maximum(kappa, 1.0) - p, 1.0)
    spread = spread * count / (count - p) + jnp.diag(jnp.where(felt, 0.0, 1.0))
    root = jnp.linalg.cholesky(spread)

    def white(columns: AnyArray) -> AnyArray:
        return jax.scipy.linalg.solve_triangular(root, axes.T @ columns, lower=True)

    columns = (white(x) for x in (observed, point.jacobian, point.effects))
    return *columns, p, OwnNoise(freedom, freedom)


def _within(problem: Problem, values: Vector) -> Vector:
    """Straight coordinates clipped to their ranges."""
    xp, ranges = namespace(values), straight(problem).ranges
    inside = [1e-12 if allowed.excludes_low else 0.0 for allowed in ranges]
    low = xp.asarray([x.low + more for x, more in zip(ranges, inside, strict=True)], values.dtype)
    return xp.clip(values, low, xp.asarray([x.high for x in ranges], values.dtype))


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


def _found(problem: Problem, values: Vector, logs: Effects, point: _Around, rows: int) -> _Found:
    """The answer around the last point; `rows` is the number of observations without padding."""
    solution = _solved(problem, point, logs)
    observed = point.effects @ logs - point.residuals
    count, variance = _count(problem, observed), problem.variance()
    likelihood = marginal_likelihood(
        observed,
        point.jacobian,
        point.effects,
        count,
        None if variance is None else known(variance),
    )
    low, high = (values + solution.quantile(level) for level in (0.025, 0.975))
    unbounded = namespace(values).where(solution.determined, 0.0, np.inf)
    low, high = low - unbounded, high + unbounded
    middle, least, most = (solution.size(level) for level in (0.5, 0.025, 0.975))
    slopes = straight(problem).slopes(straight(problem).turned(values))
    jacobian = whitened(point.jacobian / slopes, point.effects, solution.ratio)[:rows]
    scatter = Scatter(middle, least, most, solution.effect, jacobian)
    xp, covariance = namespace(observed), solution.covariance
    left = xp.abs(_within(problem, values + solution.value) - values)
    enough = _SETTLED * xp.sqrt(xp.diagonal(covariance)) + _ROUNDING * xp.abs(values)
    settled = xp.all((left <= enough) | ~solution.determined)
    return _Found(
        values,
        low,
        high,
        covariance,
        solution.freedom,
        scatter,
        likelihood,
        settled,
        solution.determined,
    )


def _ratio(errors: Vector, before: Vector) -> Vector:
    """Ratio of errors; 1 where one of them is infinite."""
    both = jnp.isfinite(errors) & jnp.isfinite(before) & (before > 0)
    return jnp.where(both, errors / jnp.where(both, before, 1.0), 1.0)


@eqx.filter_jit
def _estimate(
    estimate: Estimate[Problem], problem: Problem, found: _Found, point: _Around
) -> Estimate[Problem]:
    """The estimate with the values, intervals and residuals of a mixed model."""
    residuals, p = point.residuals, len(problem.names)
    n = _count(problem, residuals)
    missed = problem.misfit(residuals)
    settled = found.settled & jnp.all(jnp.isfinite(residuals))
    outcome = jnp.where(
        estimate.converged & ~settled, Outcome.SCATTER_UNSETTLED, estimate.outcome
    ).astype(jnp.int32)
    usable = (outcome == Outcome.CONVERGED) & (missed == 0)
    lasting = problem.noise.lasts(residuals, n)
    axes = straight(problem)
    values, (low, high) = axes.turned(found.values), axes.interval(found.low, found.high)
    slopes = axes.slopes(values)
    interval = within_ranges(problem, low, high)
    infinite = jnp.diag(jnp.where(found.determined, 0.0, jnp.inf))
    covariance = found.covariance * jnp.outer(slopes, slopes) + infinite
    errors = jnp.sqrt(jnp.diagonal(covariance))
    parameters = p + 1 + problem.sizes_found
    return dataclasses.replace(
        estimate,
        values=values,
        standard_errors=errors,
        inflation=estimate.inflation * _ratio(errors, estimate.standard_errors),
        freedom=found.freedom,
        memory=problem.noise.order(residuals, n),
        low=interval.low,
        high=interval.high,
        covariance=covariance,
        lasting=lasting,
        verdicts=verdicts(interval.below & usable, interval.above & usable, lasting),
        residuals=residuals,
        jacobian=point.jacobian / slopes,
        impacts=point.impacts,
        rms=jnp.sqrt(jnp.sum(residuals**2) / n),
        aic=2 * parameters - 2 * found.likelihood,
        bic=jnp.log(n) * parameters - 2 * found.likelihood,
        misfit=missed,
        outcome=outcome,
        scatter=found.scatter,
    )
