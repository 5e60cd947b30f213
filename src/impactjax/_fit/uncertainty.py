"""Uncertainty of a minimum: covariance, intervals and information criteria.

With the Jacobian J, the scores e = ρ′(r) and the Hessian H = Jᵀ diag(ρ″) J the covariance is
H⁻¹ cov(Jᵀ e) H⁻¹, the sandwich estimator. Prior knowledge is among the residuals here, with its own
variance.

Source: H. White (1982), "Maximum likelihood estimation of misspecified models", Econometrica 50, 1.
"""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from scipy import special

from impactjax._fit.determined import determined
from impactjax._fit.estimate import Estimate, P
from impactjax._fit.quantiles import NORMAL
from impactjax._fit.straight import straight
from impactjax._fit.verdict import Verdict
from impactjax._optimise.minimiser import Minimum
from impactjax._outcome import Outcome
from impactjax._problem.abstract_problem import AbstractProblem
from impactjax._types import Scalar

_LOST = 1e-6  # squared length of a direction that counts as lost to rounding


@eqx.filter_jit
def summarise(problem: P, minimum: Minimum, start_costs: Array) -> Estimate[P]:
    """The estimate at a minimum, with errors in linear approximation.

    - covariance: B cov(Bᵀ Jᵀ e) Bᵀ with H⁻¹ = B Bᵀ; infinite for a parameter that may change, with
      others or alone, without a change of the residuals
    - interval: value ± t · error, with the 97.5 % quantile t of Student's distribution, cut off at
      the range; of a parameter that fades, that of its inverse
    - log-likelihood: −(n log(2π s²) + S/s²)/2 with s² = S/n, or the known variance; minus
      ((p − mean)/sigma)²/2 for each prior
    - AIC = 2k − 2 log L, BIC = k log n − 2 log L; k counts parameters and unknown noise variances
    - degrees of freedom: number of observations minus that of parameters, of which prior knowledge
      tells tr(H⁻¹ H₀) with its own part H₀ of H
    """
    residuals, jacobian = minimum.answer.residuals, minimum.answer.jacobian
    assert jacobian is not None
    loss, noise = problem.assumed()
    count, p = problem.observations, len(problem.names)
    n = count.astype(residuals.dtype)
    simulated = jnp.isfinite(minimum.cost)
    squares = jnp.where(simulated, 2 * jnp.sum(loss.cost(residuals)), jnp.inf)
    values = problem.at(minimum.u)
    known = problem.variance()
    variance = squares / (n - p) if known is None else known
    stiffness = loss.stiffness(residuals)[:, None]
    rows, weight = problem.prior_rows(values), problem.prior_weight()
    root = jnp.sqrt(variance if weight is None else weight)
    prior = root * rows.slopes
    half, bounded = _half_inverse(jacobian.T @ (stiffness * jacobian) + prior.T @ prior)
    if problem.is_classical():
        spread, freedom = variance * jnp.eye(p, dtype=values.dtype), jnp.full_like(n, jnp.inf)
    else:
        along = prior @ half
        spread, freedom = _spread(problem, residuals, n, jacobian @ half, along)
        spread = spread + root**2 * (along.T @ along)
    infinite = jnp.diag(jnp.where(bounded, 0.0, jnp.inf))
    covariance = half @ spread @ half.T + infinite
    plain = variance * jnp.sum(half**2, axis=1)
    errors = jnp.sqrt(jnp.diagonal(covariance))
    axes = straight(problem)
    places, slopes = axes.turned(values), jnp.abs(axes.slopes(values))
    half_width = _quantile(freedom, residuals.shape[0]) * errors / slopes
    interval = within_ranges(problem, *axes.interval(places - half_width, places + half_width))
    size = squares / n if known is None else known
    outcome = jnp.where(count > p, minimum.outcome, Outcome.TOO_FEW_OBSERVATIONS)
    missed = problem.misfit(residuals)
    usable = (outcome == Outcome.CONVERGED) & (missed == 0)
    lasting = noise.lasts(loss.score(residuals), n)
    likelihood = -(n * jnp.log(2 * np.pi * size) + squares / size) / 2 - problem.log_units
    likelihood = jnp.where(simulated, likelihood - rows.squares / 2, -jnp.inf)
    found = p + problem.sizes_found
    return Estimate(
        problem=problem,
        values=values,
        standard_errors=errors,
        low=interval.low,
        high=interval.high,
        covariance=covariance,
        inflation=jnp.where(bounded, errors / jnp.sqrt(jnp.where(bounded, plain, 1.0)), 1.0),
        freedom=freedom,
        memory=noise.order(loss.score(residuals), n),
        lasting=lasting,
        verdicts=verdicts(interval.below & usable, interval.above & usable, lasting),
        residuals=residuals,
        jacobian=jacobian,
        impacts=minimum.answer.impacts,
        rms=jnp.where(simulated, jnp.sqrt(jnp.sum(residuals**2) / n), jnp.inf),
        aic=2 * found - 2 * likelihood,
        bic=jnp.log(n) * found - 2 * likelihood,
        misfit=missed,
        outcome=outcome.astype(jnp.int32),
        iterations=minimum.iterations,
        start_costs=start_costs,
    )


class Interval(NamedTuple):
    """Intervals of parameters, and masks of those that are bounded from below and from above."""

    low: Array
    high: Array
    below: Array
    above: Array


def within_ranges(problem: AbstractProblem, low: Array, high: Array) -> Interval:
    """Intervals cut off at the ends of the parameters' ranges."""
    lowest, highest = _ends(problem, low)
    low, high = jnp.maximum(low, lowest), jnp.minimum(high, highest)
    scale = jnp.array([handle.allowed.excludes_low for handle in problem.handles().values()])
    # A positive scale compatible with zero gets no upper bound from a linearised error.
    high = jnp.where(scale & (low <= lowest), highest, high)
    return Interval(low, high, low > lowest, high < highest)


def _ends(problem: AbstractProblem, like: Array) -> tuple[Array, Array]:
    """The ends of the parameters' ranges, of the type of other numbers."""
    ranges = [handle.allowed for handle in problem.handles().values()]
    low, high = [each.low for each in ranges], [each.high for each in ranges]
    return jnp.array(low, like.dtype), jnp.array(high, like.dtype)


def verdicts(below: Array, above: Array, lasting: Array) -> Array:
    """Verdicts on parameters, from masks of those bounded from below and from above. None is
    identified if the residuals are autocorrelated over longer times than in their noise model.
    """
    bounded = jnp.where(lasting, Verdict.UNDECIDED, Verdict.IDENTIFIED)
    both = jnp.where(below & above, bounded, Verdict.ONE_SIDED)
    return jnp.where(below | above, both, Verdict.NOT_IDENTIFIED).astype(jnp.int32)


def holding_both(estimate: Estimate[P], other: Estimate[P]) -> Estimate[P]:
    """The estimate with intervals that hold those of another one of the same problem, and errors
    that grow where the intervals are too wide for them.

    An interval stays if that of the other one is open on both sides, and its own would be in linear
    approximation: then the other one is open for this reason only. A parameter is undecided if an
    end is unknown.
    """
    lowest, highest = _ends(estimate.problem, jnp.asarray(estimate.low))
    linear = estimate.values - NORMAL * estimate.standard_errors
    silent = (other.low <= lowest) & (other.high >= highest) & ~(linear > lowest)
    low = jnp.where(silent, estimate.low, jnp.minimum(estimate.low, other.low))
    high = jnp.where(silent, estimate.high, jnp.maximum(estimate.high, other.high))
    usable = jnp.asarray(estimate.usable)
    below, above = usable & (low > lowest), usable & (high < highest)
    found = verdicts(below, above, jnp.asarray(estimate.lasting))
    unknown = usable & (jnp.isnan(low) | jnp.isnan(high))
    quantile = special.stdtrit(np.asarray(estimate.freedom), 0.975)
    growth = (high - low) / (2 * quantile * estimate.standard_errors)
    growth = jnp.where(below & above & (growth > 1), growth, 1.0)
    return dataclasses.replace(
        estimate,
        low=low,
        high=high,
        verdicts=jnp.where(unknown, Verdict.UNDECIDED, found).astype(jnp.int32),
        standard_errors=estimate.standard_errors * growth,
        covariance=estimate.covariance * jnp.outer(growth, growth),
        inflation=estimate.inflation * growth,
    )


def noise_variance(estimate: Estimate[P]) -> Scalar:
    """Variance of a residual, as it counts for the errors: S/ν with the sum of squares S and the
    degrees of freedom ν of an estimate; 1 for one without a result.
    """
    loss = estimate.problem.assumed().loss
    found = 2 * jnp.sum(loss.cost(jnp.asarray(estimate.residuals))) / estimate.freedom
    return jnp.where(jnp.isfinite(found) & jnp.isfinite(estimate.rms), found, 1.0)


def _spread(
    problem: AbstractProblem, residuals: Array, n: Scalar, directions: Array, prior: Array
) -> tuple[Array, Scalar]:
    """Covariance of the scores along some directions in the space of observations, and its degrees
    of freedom.

    The effective sample size is n/κ, with κ = tr(covariance) / its value for independent residuals.
    Directions with their part among the priors have length one; where they are shorter, information
    was lost to rounding, and the residuals along the missing part are treated as independent.
    """
    p = jnp.maximum(directions.shape[1] - jnp.sum(prior**2), jnp.finfo(prior.dtype).eps)
    loss, noise = problem.assumed()
    scores = loss.score(residuals)
    size = jnp.sum(scores**2) / n
    lacking = jnp.maximum(1 - jnp.sum(directions**2, axis=0) - jnp.sum(prior**2, axis=0), 0)
    lost = jnp.diag(jnp.where(lacking > _LOST, lacking, 0.0)) * size
    spread = noise.spread(scores, n, directions) + lost
    kappa = jnp.trace(spread) / (p * jnp.where(size > 0, size, 1.0))
    effective = jnp.maximum(n / jnp.maximum(kappa, 1.0), p + 1.0)
    return spread * effective / (effective - p), effective - p


def _quantile(freedom: Scalar, most: int) -> Scalar:
    """The 0.975 quantile of Student's t, interpolated in the degrees of freedom."""
    whole = np.arange(1.0, most + 1)
    table = special.stdtrit(whole, 0.975)
    whole, table = jnp.asarray(whole, freedom.dtype), jnp.asarray(table, freedom.dtype)
    student = jnp.interp(jnp.nan_to_num(freedom), whole, table)
    return jnp.where(jnp.isfinite(freedom), student, NORMAL)


def _half_inverse(information: Array) -> tuple[Array, Array]:
    """A matrix B with B Bᵀ the pseudo-inverse of the information, and a mask of the parameters that
    have no component in a direction without information.

    The information is first scaled to a unit diagonal. Eigenvalues below rounding count as zero.
    """
    diagonal = jnp.diagonal(information)
    informative = diagonal > 0
    scale = jnp.where(informative, jnp.sqrt(jnp.where(informative, diagonal, 1.0)), 1.0)
    scaled = information / (scale[:, None] * scale[None, :])
    scaled = jnp.where(informative[:, None] & informative[None, :], scaled, jnp.eye(len(scale)))
    eigenvalues, vectors = jnp.linalg.eigh(scaled)
    floor = len(scale) * jnp.finfo(scale.dtype).eps
    felt = eigenvalues > floor
    half = vectors * jnp.where(felt, 1 / jnp.sqrt(jnp.where(felt, eigenvalues, 1.0)), 0.0)
    half = jnp.where(informative[:, None], half / scale[:, None], 0.0)
    return half, informative & determined(vectors.T, felt)
