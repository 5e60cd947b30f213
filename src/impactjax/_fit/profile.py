"""Profile likelihood: intervals from refits with one parameter held.

Source: D. J. Venzon and S. H. Moolgavkar (1988), "A method for computing
profile-likelihood-based confidence intervals", Applied Statistics 37, 87; A. Raue et al. (2009),
"Structural and practical identifiability analysis", Bioinformatics 25, 1923.
"""

import dataclasses
import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy import special

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.search import Search, Searches
from impactjax._fit.straight import Straight, straight
from impactjax._fit.verdict import Verdict
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt

_FIRST, _GROWTH, _FARTHEST = 2.0, 4.0, 200.0  # distances of the held values, in standard errors
_ROUNDS = 12  # most refits on one side
_NEAR = 0.02  # relative distance of the rise from its limit at which the end counts as found
_PLAIN = 4.0  # distance beyond which a side is open even if simulations fail farther out
_DIFFERENT = 1.5  # ratio of two errors above which the standard error is replaced
_CLOSE = 0.1  # relative distance to a failing simulation at which the walk ends


def profiled(
    estimate: Estimate[P], optimiser: LevenbergMarquardt = LevenbergMarquardt()
) -> Estimate[P]:
    """The estimate with intervals and verdicts from the profile likelihood.

    Each parameter is held at values on both sides of its estimate while the others are fitted
    again. The interval ends where √((S − S_min)/σ²), with the sum of squares S of the refit,
    reaches the 97.5 % quantile of Student's t, times `inflation` for correlated residuals. A side
    on which it never does is open.

    If the search for an end cannot continue, because the simulation fails there or the limit is
    not found, the end is NaN and the verdict `UNDECIDED`; it is also that of a bounded parameter if
    the correlation of the residuals is `lasting`. A standard error that differs from the
    interval by a factor of 1.5 or more is replaced by that of the interval. An estimate that is
    not `usable`, or has scatter from impact to impact, is returned unchanged: the intervals of the
    latter are integrals over the size of the scatter.

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
    for _ in range(_ROUNDS):
        going = [walk for walk in walks if not walk.done]
        if not going:
            break
        held = [walk.next_value() for walk in going]
        rises = _rises(estimate, optimiser, local, going, held, search)
        for walk, rise in zip(going, rises, strict=True):
            walk.learn(float(rise))
    below, above = walks[::2], walks[1::2]
    low = np.array([walk.end(each.low) for walk, each in zip(below, ranges, strict=True)])
    high = np.array([walk.end(each.high) for walk, each in zip(above, ranges, strict=True)])
    ends = np.where(local.coordinates.fades, (high, low), (low, high))
    low, high = local.coordinates.turned(ends)
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


@dataclasses.dataclass
class _Walk:
    """Search for the end of an interval, outwards from the estimate on one side of one parameter.

    Distances are in standard errors; for a positive parameter whose error exceeds half its value,
    they are differences of its natural logarithm.
    """

    parameter: int
    side: int
    centre: float
    unit: float
    logarithmic: bool
    farthest: float  # distance to the end of the range
    limit: float  # rise at the end of the interval
    inner: tuple[float, float] = (0.0, 0.0)  # distance and rise of a point inside the interval
    outer: tuple[float, float] | None = None  # distance and rise of a point outside it
    barrier: float = math.inf  # distance at which the simulation failed
    distance: float = 0.0
    follows: bool = True  # the others start at their conditional expectation, not at the estimate
    done: bool = False
    bounded: bool = False

    @property
    def failed(self) -> bool:
        """True if neither the end was found nor the side shown to be open."""
        return not self.bounded and self.inner[0] < min(self.farthest, _PLAIN)

    def value(self, distance: float) -> float:
        """The parameter at a distance."""
        if self.logarithmic:
            return self.centre * math.exp(self.side * distance)
        return self.centre + self.side * distance * self.unit

    def next_value(self) -> float:
        """The value to hold next: farther out, or between points on both sides of the limit."""
        if self.outer is None:
            ahead = _FIRST if self.inner[0] == 0 else _GROWTH * self.inner[0]
            self.distance = min(ahead, self.farthest)
            if self.distance >= self.barrier:
                a, low = self.inner
                expected = a * self.limit / low if low > 0 else math.inf
                self.distance = min(expected, (a + self.barrier) / 2)
        else:
            (a, low), (b, high) = self.inner, self.outer
            share = (self.limit - low) / (high - low)
            self.distance = a + float(np.clip(share, 0.1, 0.9)) * (b - a)
        return self.value(self.distance)

    def learn(self, rise: float) -> None:
        """Records the rise at the value that was held; NaN if the simulation failed."""
        if math.isnan(rise) and self.follows:
            self.follows = False  # try the same value again: the others may have left their range
            return
        if math.isnan(rise) and self.outer is None:
            self.barrier = self.distance
            self.done = self.barrier - self.inner[0] < _CLOSE * self.barrier
            return
        at_limit = abs(rise - self.limit) < _NEAR * self.limit
        if rise >= self.limit or at_limit:
            self.outer, self.bounded = (self.distance, rise), True
        elif rise < self.limit:
            self.inner = (self.distance, rise)
        far = self.distance >= min(self.farthest, _FARTHEST)
        self.done = at_limit or math.isnan(rise) or (self.outer is None and far)

    def end(self, beyond: float) -> float:
        """The end of the interval; NaN if it is not known."""
        if self.failed:
            return math.nan
        if not self.bounded:
            return beyond
        assert self.outer is not None
        (a, low), (b, high) = self.inner, self.outer
        share = (self.limit - low) / (high - low)
        return self.value(a + share * (b - a))


def _verdict(below: _Walk, above: _Walk, lasting: bool) -> Verdict:
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


def _begin(estimate: Estimate[P], local: _Local, parameter: int, side: int) -> _Walk:
    allowed, centre = local.coordinates.ranges[parameter], float(local.values[parameter])
    error = math.sqrt(float(local.covariance[parameter, parameter]))
    error = error if math.isfinite(error) else max(abs(centre), 1e-6)
    logarithmic = allowed.excludes_low and allowed.low == 0 and error > centre / 2
    room = (centre - allowed.low) if side < 0 else (allowed.high - centre)
    farthest = math.inf if logarithmic else room / error
    limit = float(special.stdtrit(float(estimate.freedom), 0.975))
    limit *= max(float(np.asarray(estimate.inflation)[parameter]), 1.0)
    walk = _Walk(parameter, side, centre, error, logarithmic, farthest, limit)
    walk.done = farthest <= 0 or not math.isfinite(float(estimate.rms))
    return walk


def _rises(
    estimate: Estimate[P],
    optimiser: LevenbergMarquardt,
    local: _Local,
    walks: list[_Walk],
    held: list[float],
    search: Search,
) -> np.ndarray:
    """√((S − S_min)/σ²) at each held value, with the sum of squares S of the refit."""
    starts = np.array([_start(local, w, v) for w, v in zip(walks, held, strict=True)])
    active = np.ones(starts.shape, bool)
    active[np.arange(len(walks)), [walk.parameter for walk in walks]] = False
    # Refits start near the optimum, so every horizon is the full record; their usual number is kept
    # to reuse the compiled program.
    problem = estimate.problem.padded()
    whole = np.tile(np.asarray(problem.valid), (len(optimiser.horizons), 1))
    lowest, highest, _ = np.transpose(problem.limits())
    places = np.clip(problem.coordinates(local.coordinates.turned(starts)), lowest, highest)
    minima = search.minima(problem, optimiser, Searches(places, active, whole))
    squares = 2 * minima.cost
    n = int(estimate.problem.observations)
    best = 2 * float(np.nanmin(estimate.start_costs))
    known = estimate.problem.variance()
    variance = best / (n - len(estimate.names)) if known is None else float(known)
    excess = (squares - best) / variance
    return np.sqrt(np.maximum(np.where(np.isfinite(excess), excess, np.nan), 0))


def _start(local: _Local, walk: _Walk, value: float) -> np.ndarray:
    """Start of a refit: the expectation of the other parameters, given the held one,
    p + C eⱼ (v − pⱼ) / Cⱼⱼ with the covariance C; clipped to their ranges.
    """
    values, ranges = local.values, local.coordinates.ranges
    together = local.covariance[:, walk.parameter]
    variance = together[walk.parameter]
    known = walk.follows and 0 < variance < math.inf
    start = values + (together / variance * (value - walk.centre) if known else 0.0)
    nearest = [1e-3 if allowed.excludes_low else 0.0 for allowed in ranges]
    lowest = [
        allowed.low + near * (value - allowed.low) if near else allowed.low
        for allowed, near, value in zip(ranges, nearest, values, strict=True)
    ]
    start = np.clip(start, lowest, [r.high for r in ranges])
    start[walk.parameter] = value
    return start
