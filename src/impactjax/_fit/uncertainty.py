"""Uncertainty of a minimum: covariance, intervals and information criteria.

With the Jacobian J, the scores e = ρ′(r) and the Hessian H = Jᵀ diag(ρ″) J the covariance is
H⁻¹ cov(Jᵀ e) H⁻¹, the sandwich estimator. Prior knowledge is among the residuals here, with its own
variance.

Source: H. White (1982), "Maximum likelihood estimation of misspecified models", Econometrica 50, 1.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import special

from impactjax._fit.determined import determined
from impactjax._fit.estimate import Estimate, P
from impactjax._fit.quantiles import NORMAL
from impactjax._fit.straight import straight
from impactjax._fit.verdict import Verdict
from impactjax._known import AnyArray, known, namespace
from impactjax._optimise.minimiser import Minimum
from impactjax._outcome import Outcome
from impactjax._problem.abstract_problem import AbstractProblem, Number
from impactjax._problem.noise import AbstractNoise

_LOST = 1e-6  # squared length of a direction that counts as lost to rounding


@np.errstate(all="ignore")  # no warnings, as in JAX
def summarise(problem: P, minimum: Minimum, start_costs: AnyArray) -> Estimate[P]:
    """The estimate at a minimum, with errors in linear approximation.

    - covariance: B cov(Bᵀ Jᵀ e) Bᵀ with H⁻¹ = B Bᵀ; infinite for a parameter that may change, with
      others or alone, without a change of the residuals
    - interval: value ± t · error, with the 97.5 % quantile t of Student's distribution, cut off at
      the range; that of a power of the parameter where residuals are nearly linear in this power
    - log-likelihood: −(n log(2π s²) + S/s²)/2 with s² = S/n, or the known variance; minus
      ((p − mean)/sigma)²/2 for each prior
    - AIC = 2k − 2 log L, BIC = k log n − 2 log L; k counts parameters and unknown noise variances
    - degrees of freedom: number of observations minus that of parameters, of which prior knowledge
      tells tr(H⁻¹ H₀) with its own part H₀ of H
    """
    own, (problem, minimum, start_costs) = problem, known((problem, minimum, start_costs))
    xp = namespace(problem, minimum)
    residuals, jacobian = minimum.answer.residuals, minimum.answer.jacobian
    assert jacobian is not None
    loss, noise = problem.assumed()
    cost, scores, stiffness = known(
        (loss.cost(residuals), loss.score(residuals), loss.stiffness(residuals))
    )
    count, p = problem.observations, len(problem.names)
    n = count.astype(residuals.dtype)
    simulated = xp.isfinite(minimum.cost)
    squares = xp.where(simulated, 2 * xp.sum(cost), xp.inf)
    values = problem.at(minimum.u)
    given = problem.variance()
    variance = squares / (n - p) if given is None else given
    rows, weight = problem.prior_rows(values), problem.prior_weight()
    root = xp.sqrt(variance if weight is None else weight)
    prior = root * rows.slopes
    half, bounded = _half_inverse(jacobian.T @ (stiffness[:, None] * jacobian) + prior.T @ prior)
    if problem.is_classical():
        spread, freedom = variance * xp.eye(p, dtype=values.dtype), xp.full_like(n, xp.inf)
    else:
        along = prior @ half
        spread, freedom = _spread(noise, scores, n, jacobian @ half, along)
        spread = spread + root**2 * (along.T @ along)
    infinite = xp.diag(xp.where(bounded, 0.0, xp.inf))
    covariance = half @ spread @ half.T + infinite
    plain = variance * xp.sum(half**2, axis=1)
    errors = xp.sqrt(xp.diagonal(covariance))
    axes = straight(problem)
    places, slopes = axes.places(values), xp.abs(axes.slopes(values))
    half_width = _quantile(freedom, residuals.shape[0]) * errors / slopes
    interval = within_ranges(problem, *axes.interval(places - half_width, places + half_width))
    size = squares / n if given is None else given
    outcome = xp.where(count > p, minimum.outcome, Outcome.TOO_FEW_OBSERVATIONS)
    missed = problem.misfit(residuals)
    usable = (outcome == Outcome.CONVERGED) & (missed == 0)
    lasting = noise.lasts(scores, n)
    exceeds_noise = problem.exceeds_noise(residuals, minimum.answer.impacts)
    doubtful = lasting | exceeds_noise
    likelihood = -(n * xp.log(2 * np.pi * size) + squares / size) / 2 - problem.log_units
    likelihood = xp.where(simulated, likelihood - rows.squares / 2, -xp.inf)
    found = p + problem.sizes_found
    return Estimate(
        problem=own,
        values=values,
        standard_errors=errors,
        low=interval.low,
        high=interval.high,
        covariance=covariance,
        inflation=xp.where(bounded, errors / xp.sqrt(xp.where(bounded, plain, 1.0)), 1.0),
        freedom=freedom,
        memory=noise.order(scores, n),
        lasting=lasting,
        exceeds_noise=exceeds_noise,
        verdicts=verdicts(interval.below & usable, interval.above & usable, doubtful),
        residuals=residuals,
        jacobian=jacobian,
        impacts=minimum.answer.impacts,
        rms=xp.where(simulated, xp.sqrt(xp.sum(residuals**2) / n), xp.inf),
        aic=2 * found - 2 * likelihood,
        bic=xp.log(n) * found - 2 * likelihood,
        misfit=missed,
        outcome=outcome.astype(np.int32),
        iterations=minimum.iterations,
        start_costs=start_costs,
    )


class Interval(NamedTuple):
    """Intervals of parameters, and masks of those that are bounded from below and from above."""

    low: AnyArray
    high: AnyArray
    below: AnyArray
    above: AnyArray


def within_ranges(problem: AbstractProblem, low: AnyArray, high: AnyArray) -> Interval:
    """Intervals cut off at the ends of the parameters' ranges."""
    xp, (lowest, highest) = namespace(low, high), _ends(problem, low)
    low, high = xp.maximum(low, lowest), xp.minimum(high, highest)
    scale = np.array([handle.allowed.excludes_low for handle in problem.handles().values()])
    # A positive scale compatible with zero gets no upper bound from a linearised error.
    high = xp.where(scale & (low <= lowest), highest, high)
    return Interval(low, high, low > lowest, high < highest)


def _ends(problem: AbstractProblem, like: AnyArray) -> tuple[AnyArray, AnyArray]:
    """The ends of the parameters' ranges, of the type of other numbers."""
    ranges = [handle.allowed for handle in problem.handles().values()]
    low, high = [each.low for each in ranges], [each.high for each in ranges]
    return np.array(low, like.dtype), np.array(high, like.dtype)


def verdicts(below: AnyArray, above: AnyArray, doubtful: AnyArray) -> AnyArray:
    """Verdicts on parameters, from masks of those bounded from below and from above. None is
    identified in a doubtful estimate.
    """
    xp = namespace(below, above, doubtful)
    bounded = xp.where(doubtful, Verdict.UNDECIDED, Verdict.IDENTIFIED)
    both = xp.where(below & above, bounded, Verdict.ONE_SIDED)
    return xp.where(below | above, both, Verdict.NOT_IDENTIFIED).astype(np.int32)


@np.errstate(all="ignore")
def holding_both(estimate: Estimate[P], other: Estimate[P]) -> Estimate[P]:
    """The estimate with intervals that hold those of another one of the same problem."""
    return holding(estimate, *known((other.low, other.high)))


def holding(estimate: Estimate[P], low: AnyArray, high: AnyArray) -> Estimate[P]:
    """The estimate with intervals that hold others within the parameters' ranges, and errors that
    grow where the intervals are too wide for them.

    An interval stays if the other one is open on both sides, and its own would be in linear
    approximation: then the other one is open for this reason only. A parameter is undecided if an
    end is unknown.
    """
    problem, estimate = estimate.problem, known(estimate)
    lowest, highest = _ends(estimate.problem, estimate.low)
    low, high = np.maximum(low, lowest), np.minimum(high, highest)
    linear = estimate.values - NORMAL * estimate.standard_errors
    silent = (low <= lowest) & (high >= highest) & ~(linear > lowest)
    low = np.where(silent, estimate.low, np.minimum(estimate.low, low))
    high = np.where(silent, estimate.high, np.maximum(estimate.high, high))
    usable = estimate.usable
    below, above = usable & (low > lowest), usable & (high < highest)
    found = verdicts(below, above, estimate.doubtful)
    unknown = usable & (np.isnan(low) | np.isnan(high))
    quantile = special.stdtrit(estimate.freedom, 0.975)
    with np.errstate(invalid="ignore"):  # an open interval of a value without an error
        growth = (high - low) / (2 * quantile * estimate.standard_errors)
    growth = np.where(below & above & (growth > 1), growth, 1.0)
    return dataclasses.replace(
        estimate,
        problem=problem,
        low=low,
        high=high,
        verdicts=np.where(unknown, Verdict.UNDECIDED, found).astype(np.int32),
        standard_errors=estimate.standard_errors * growth,
        covariance=estimate.covariance * np.outer(growth, growth),
        inflation=estimate.inflation * growth,
    )


def noise_variance(estimate: Estimate[P]) -> Float[AnyArray, ""]:
    """Variance of a residual, as it counts for the errors: S/ν with the sum of squares S and the
    degrees of freedom ν of an estimate; 1 for one without a result.
    """
    problem, residuals, freedom, rms = known(
        (estimate.problem, estimate.residuals, estimate.freedom, estimate.rms)
    )
    cost = known(problem.assumed().loss.cost(residuals))
    xp = namespace(cost, freedom, rms)
    found = 2 * xp.sum(cost) / freedom
    return xp.where(xp.isfinite(found) & xp.isfinite(rms), found, 1.0)


def _spread(
    noise: AbstractNoise, scores: AnyArray, n: Number, directions: AnyArray, prior: AnyArray
) -> tuple[AnyArray, Number]:
    """Covariance of the scores along some directions in the space of observations, and its degrees
    of freedom.

    The effective sample size is n/κ, with κ = tr(covariance) / its value for independent residuals.
    Directions with their part among the priors have length one; where they are shorter, information
    was lost to rounding, and the residuals along the missing part are treated as independent.
    """
    xp = namespace(scores, n, directions, prior)
    p = xp.maximum(directions.shape[1] - xp.sum(prior**2), np.finfo(prior.dtype).eps)
    size = xp.sum(scores**2) / n
    lacking = xp.maximum(1 - xp.sum(directions**2, axis=0) - xp.sum(prior**2, axis=0), 0)
    lost = xp.diag(xp.where(lacking > _LOST, lacking, 0.0)) * size
    spread = noise.spread(scores, n, directions) + lost
    kappa = xp.trace(spread) / (p * xp.where(size > 0, size, 1.0))
    effective = xp.maximum(n / xp.maximum(kappa, 1.0), p + 1.0)
    return spread * effective / (effective - p), effective - p


def _quantile(freedom: Number, most: int) -> Number:
    """The 0.975 quantile of Student's t, interpolated in the degrees of freedom."""
    xp, whole = namespace(freedom), np.arange(1.0, most + 1)
    table = special.stdtrit(whole, 0.975)
    whole, table = np.asarray(whole, freedom.dtype), np.asarray(table, freedom.dtype)
    student = xp.interp(xp.nan_to_num(freedom), whole, table)
    return xp.where(xp.isfinite(freedom), student, NORMAL)


def _half_inverse(information: AnyArray) -> tuple[AnyArray, AnyArray]:
    """A matrix B with B Bᵀ the pseudo-inverse of the information, and a mask of the parameters that
    have no component in a direction without information. Information that is not finite bounds
    none, and its B is NaN.

    The information is first scaled to a unit diagonal. Eigenvalues below rounding count as zero.
    """
    xp, count = namespace(information), information.shape[0]
    finite, unit = xp.all(xp.isfinite(information)), xp.eye(count, dtype=information.dtype)
    information = xp.where(finite, information, unit)
    diagonal = xp.diagonal(information)
    informative = diagonal > 0
    scale = xp.where(informative, xp.sqrt(xp.where(informative, diagonal, 1.0)), 1.0)
    scaled = information / (scale[:, None] * scale[None, :])
    scaled = xp.where(informative[:, None] & informative[None, :], scaled, unit)
    eigenvalues, vectors = xp.linalg.eigh(scaled)
    felt = eigenvalues > count * np.finfo(scale.dtype).eps
    half = vectors * xp.where(felt, 1 / xp.sqrt(xp.where(felt, eigenvalues, 1.0)), 0.0)
    half = xp.where(informative[:, None], half / scale[:, None], 0.0)
    bounded = finite & informative & determined(vectors.T, felt)
    return xp.where(finite, half, xp.nan), bounded
