"""Profile likelihood: intervals from refits with one parameter held.

Source: D. J. Venzon and S. H. Moolgavkar (1988), "A method for computing
profile-likelihood-based confidence intervals", Applied Statistics 37, 87; A. Raue et al. (2009),
"Structural and practical identifiability analysis", Bioinformatics 25, 1923.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy import special

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.profile_walk import Walk
from impactjax._fit.search import Search, Searches
from impactjax._fit.straight import Straight, straight
from impactjax._fit.verdict import Verdict
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.minimiser import Minimum

_ROUNDS = 12  # most refits on one side
_DIFFERENT = 1.5  # ratio of two errors above which the standard error is replaced
_LOWER = 1.0  # fall of S/σ² below the estimate from which that is not the minimum


def profiled(
    estimate: Estimate[P], optimiser: LevenbergMarquardt = LevenbergMarquardt()
) -> Estimate[P]:
    """The estimate with intervals and verdicts from the profile likelihood.

    Each parameter is held at values on both sides of its estimate while the others are fitted
    again. The interval ends where √((S − S_min)/σ²), with the sum of squares S of the refit,
    reaches the 97.5 % quantile of Student's t, times `inflation` for correlated residuals. A side
    on which it never does is open.

    If the search for an end cannot continue, because the simulation fails there, a lower minimum
    appears or the limit is not found, the end is NaN and the verdict `UNDECIDED`; it is also that
    of a bounded parameter if the correlation of the residuals is `lasting`. A standard error that
    differs from the interval by a factor of 1.5 or more is replaced by that of the interval. An
    estimate that is not `usable`, or has scatter from impact to impact, is returned unchanged: the
    intervals of the latter are integrals over the size of the scatter.

    **Arguments:**

    - `estimate`: estimate of a single fit.
    - `optimiser`: settings of the refits.

    Source: Venzon and Moolgavkar, Applied Statistics 37, 87 (1988).
    """
    return profiled_by(Search(), estimate, optimiser)


def profiled_by(
    search: Search, estimate: Estimate[P], optimiser: LevenbergMarquardt = LevenbergMarquardt()
) -> Estimate[P]:
    """Variant of `profiled` with a given search."""
    estimate.check_single()
    if not bool(estimate.usable) or estimate.scatter is not None:
        return estimate
    local, ranges = _local(estimate), straight(estimate.problem).ranges
    count = len(ranges)
    walks = [_begin(estimate, local, j, side) for j in range(count) for side in (-1, 1)]
    centres = [local]
    if any(local.coordinates.fades):
        faded, rise = _faded(estimate, optimiser, local, search)
        centres.append(faded)
        for walk in walks:
            walk.include(float(faded.values[walk.parameter]), rise)
    for _ in range(_ROUNDS):
        going = [walk for walk in walks if not walk.done]
        if not going:
            break
        held = [walk.next_value() for walk in going]
        rises = _rises(estimate, optimiser, centres, going, held, search)
        for walk, rise in zip(going, rises, strict=True):
            walk.learn(float(rise))
    below, above = walks[::2], walks[1::2]
    low = np.array([walk.end(each.low) for walk, each in zip(below, ranges, strict=True)])
    high = np.array([walk.end(each.high) for walk, each in zip(above, ranges, strict=True)])
    low, high = local.coordinates.interval(low, high)
    both = [a.bounded and b.bounded for a, b in zip(below, above, strict=True)]
    errors, covariance = _agreeing(estimate, np.where(both, high - low, 0))
    lasting = bool(estimate.lasting)
    found = [_verdict(a, b, lasting) for a, b in zip(below, above, strict=True)]
    verdicts = np.array(found, np.int32)
    return eqx.tree_at(
        lambda each: (each.low, each.high, each.verdicts, each.standard_errors, each.covariance),
        estimate,
        tuple(jnp.asarray(x) for x in (low, high, verdicts, errors, covariance)),
    )


def _agreeing(estimate: Estimate[P], widths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard errors and covariance, scaled to agree with the widths of the intervals; a width of
    zero stands for an unknown one.

    Both agree without scaling for small errors. They do not if another parameter is at the end of
    its range, which linearised errors ignore: correlated parameters then get too large errors.
    """
    errors, covariance = np.asarray(estimate.standard_errors), np.asarray(estimate.covariance)
    half = widths / 2 / special.stdtrit(float(estimate.freedom), 0.975)
    usual = np.isfinite(errors) & (errors > 0)
    ratios = np.where(usual & (half > 0), half / np.where(usual, errors, 1.0), 1.0)
    ratios = np.where(np.abs(np.log(ratios)) > np.log(_DIFFERENT), ratios, 1.0)
    finite = np.where(np.isfinite(covariance), covariance * np.outer(ratios, ratios), covariance)
    return errors * ratios, finite


def _verdict(below: Walk, above: Walk, lasting: bool) -> Verdict:
    both = below.bounded and above.bounded
    if below.failed or above.failed or (both and lasting):
        return Verdict.UNDECIDED
    kinds = (Verdict.NOT_IDENTIFIED, Verdict.ONE_SIDED, Verdict.IDENTIFIED)
    return kinds[below.bounded + above.bounded]


class _Local(NamedTuple):
    """An estimate in linear approximation, in straight coordinates."""

    coordinates: Straight
    values: np.ndarray
    covariance: np.ndarray


def _local(estimate: Estimate[P]) -> _Local:
    values, own = np.asarray(estimate.values), straight(estimate.problem)
    slopes = own.slopes(values)
    covariance = np.asarray(estimate.covariance) / np.outer(slopes, slopes)
    return _Local(own, own.turned(values), covariance)


def _begin(estimate: Estimate[P], local: _Local, parameter: int, side: int) -> Walk:
    allowed, centre = local.coordinates.ranges[parameter], float(local.values[parameter])
    error = math.sqrt(float(local.covariance[parameter, parameter]))
    error = error if math.isfinite(error) else max(abs(centre), 1e-6)
    logarithmic = allowed.excludes_low and allowed.low == 0 and error > centre / 2
    room = (centre - allowed.low) if side < 0 else (allowed.high - centre)
    farthest = math.inf if logarithmic else room / error
    limit = float(special.stdtrit(float(estimate.freedom), 0.975))
    limit *= max(float(np.asarray(estimate.inflation)[parameter]), 1.0)
    walk = Walk(parameter, side, centre, error, logarithmic, farthest, limit)
    walk.done = farthest <= 0 or not math.isfinite(float(estimate.rms))
    return walk


def _rises(
    estimate: Estimate[P],
    optimiser: LevenbergMarquardt,
    centres: Sequence[_Local],
    walks: list[Walk],
    held: list[float],
    search: Search,
) -> np.ndarray:
    """√((S − S_min)/σ²) at each held value, with the lowest sum of squares S of the refits that
    begin around each centre.
    """
    problem = estimate.problem.padded()
    each = [(local, *pair) for local in centres for pair in zip(walks, held, strict=True)]
    starts = np.array([local.coordinates.turned(_start(local, w, v)) for local, w, v in each])
    lowest, highest, _ = np.transpose(problem.limits())
    places = np.clip(problem.coordinates(starts), lowest, highest)
    active = np.ones(places.shape, bool)
    active[np.arange(len(each)), [walk.parameter for _, walk, _ in each]] = False
    minima = _refits(estimate, optimiser, places, active, search)
    rises = _rise(estimate, np.asarray(minima.cost)).reshape(len(centres), len(walks))
    known = np.where(np.isnan(rises), np.inf, rises).min(axis=0)
    return np.where(np.isinf(known), np.nan, known)


def _faded(
    estimate: Estimate[P], optimiser: LevenbergMarquardt, local: _Local, search: Search
) -> tuple[_Local, float]:
    """The minimum where the effects of parameters that fade have vanished, and its rise. It may be
    another one than the estimate.
    """
    problem, fades = estimate.problem.padded(), np.array(local.coordinates.fades)
    lowest = np.array([each.low for each in problem.limits()])
    start = np.where(fades, lowest, problem.coordinates(np.asarray(estimate.values)))
    minima = _refits(estimate, optimiser, start[None], ~fades[None], search)
    values = local.coordinates.turned(np.asarray(problem.at(np.asarray(minima.u[0]))))
    slopes = np.where(fades, 0.0, np.asarray(estimate.jacobian))
    norms = np.linalg.norm(slopes, axis=0)
    sizes = np.where(norms > 0, norms, 1.0)
    scaled = slopes / sizes
    covariance = np.linalg.pinv(scaled.T @ scaled, hermitian=True) / np.outer(sizes, sizes)
    there = _Local(local.coordinates, values, covariance)
    return there, float(_rise(estimate, np.asarray(minima.cost))[0])


def _refits(
    estimate: Estimate[P],
    optimiser: LevenbergMarquardt,
    places: np.ndarray,
    active: np.ndarray,
    search: Search,
) -> Minimum:
    """Minima of searches from some places, in which some parameters are held.

    They start near the optimum, so every horizon is the full record; their usual number is kept to
    reuse the compiled program.
    """
    problem = estimate.problem.padded()
    whole = np.tile(np.asarray(problem.valid), (len(optimiser.horizons), 1))
    return search.minima(problem, optimiser, Searches(places, active, whole))


def _rise(estimate: Estimate[P], costs: np.ndarray) -> np.ndarray:
    """√((S − S_min)/σ²) for some costs S/2; NaN if one is not finite, or is lower than that of the
    estimate.
    """
    n = int(estimate.problem.observations)
    best = 2 * float(np.nanmin(estimate.start_costs))
    known = estimate.problem.variance()
    variance = best / (n - len(estimate.names)) if known is None else float(known)
    excess = (2 * costs - best) / variance
    excess = np.where(np.isfinite(excess) & (excess > -_LOWER), excess, np.nan)
    return np.sqrt(np.maximum(excess, 0))


def _start(local: _Local, walk: Walk, value: float) -> np.ndarray:
    """Start of a refit: the expectation of the other parameters, given the held one,
    p + C eⱼ (v − pⱼ) / Cⱼⱼ with the covariance C; clipped to their ranges.
    """
    values, ranges = local.values, local.coordinates.ranges
    together = local.covariance[:, walk.parameter]
    variance = together[walk.parameter]
    known = walk.follows and 0 < variance < math.inf
    away = value - values[walk.parameter]
    start = values + (together / variance * away if known else 0.0)
    nearest = [1e-3 if allowed.excludes_low else 0.0 for allowed in ranges]
    lowest = [
        allowed.low + near * (value - allowed.low) if near else allowed.low
        for allowed, near, value in zip(ranges, nearest, values, strict=True)
    ]
    start = np.clip(start, lowest, [r.high for r in ranges])
    start[walk.parameter] = value
    return start
