"""Refits with some parameters held: minima over the others, with their linear models."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.search import Search, Searches
from impactjax._optimise.coordinates import limits, to_value
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Linearisation
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import AbstractProblem

_ENOUGH = 0.005  # fall of the cost, in variances, that a Gauss-Newton step may still promise
_FAR = 0.01  # the same, relative to the rise of the cost
_SHORT = 0.1  # longest such step, relative to the longest step of a search
_LOWER = 1.0  # fall of S/σ² below the estimate from which that is not the minimum
_STEPS = 4  # evaluations before a search

Rows = Float[np.ndarray, "lanes parameters"]
Mask = Bool[np.ndarray, "lanes parameters"]
Squares = Float[np.ndarray, "lanes parameters parameters"]
Column = Float[np.ndarray, " lanes"]
Costs = Float[np.ndarray, "..."]


class Points(NamedTuple):
    """Points in the coordinates of a search, with the cost F around them: F + gᵀ p + pᵀ H p / 2.

    - `u`: the coordinates.
    - `cost`: F; infinite if the simulation failed.
    - `gradient`, `hessian`: g and H, by Gauss and Newton.
    - `moving`: mask of the parameters that may move from there.
    """

    u: Rows
    cost: Column
    gradient: Rows
    hessian: Squares
    moving: Mask

    def solved(self, rows: Rows) -> Rows:
        """Solutions x of H x = rows among the parameters that may move, those without an effect
        left out; the other entries are 0.
        """
        sizes = np.sqrt(np.einsum("nii->ni", self.hessian))
        moving = self.moving & (sizes > 0) & np.isfinite(self.cost)[:, None]
        sizes = np.where(moving, sizes, 1.0)
        both = moving[:, :, None] & moving[:, None, :]
        scaled = np.where(both, self.hessian, np.eye(rows.shape[1]))
        scaled = scaled / (sizes[:, :, None] * sizes[:, None, :])
        right = np.where(moving, rows, 0.0) / sizes
        return np.linalg.solve(scaled, right[..., None])[..., 0] / sizes

    def along(self, directions: Rows) -> Rows:
        """Changes of all parameters with a change of held ones, so that the minimum is kept."""
        return directions - self.solved(np.einsum("nij,nj->ni", self.hessian, directions))

    def decrease(self, steps: Rows) -> Column:
        """Decrease of the cost by some steps in the quadratic model."""
        bent = np.einsum("nij,nj->ni", self.hessian, steps)
        return -((self.gradient + bent / 2) * steps).sum(axis=1)

    def stepped(self, steps: Rows) -> "Points":
        """The points after some steps in the quadratic model; H stays."""
        gradient = self.gradient + np.einsum("nij,nj->ni", self.hessian, steps)
        cost = self.cost - self.decrease(steps)
        return self._replace(u=self.u + steps, cost=cost, gradient=gradient)

    def replaced(self, at: np.ndarray, others: "Points") -> "Points":
        """The points with others in some places."""
        return Points(*(_put(x, at, new) for x, new in zip(self, others, strict=True)))


def _put(x: np.ndarray, at: np.ndarray, new: np.ndarray) -> np.ndarray:
    filled = x.copy()
    filled[at] = new
    return filled


def joined(points: Sequence[Points]) -> Points:
    """Several points as one."""
    return Points(*(np.concatenate(each) for each in zip(*points, strict=True)))


@dataclasses.dataclass(frozen=True)
class Refits:
    """Searches of minima with some parameters held, from starts close to them.

    - `problem`: the padded problem.
    - `lowest`, `variance`: cost of the estimate, and variance of a residual.
    - `ranges`: ranges of the parameters.
    """

    problem: AbstractProblem
    optimiser: LevenbergMarquardt
    search: Search
    lowest: float
    variance: float
    ranges: tuple[Range, ...]

    def values(self, u: Float[np.ndarray, "... parameters"]) -> Float[np.ndarray, "... parameters"]:
        """Natural values at some coordinates."""
        each = [to_value(allowed, u[..., i]) for i, allowed in enumerate(self.ranges)]
        return np.stack(each, axis=-1)

    def enough(self, costs: Costs) -> Costs:
        """Errors of some costs that do not matter."""
        return _ENOUGH * self.variance + _FAR * np.maximum(costs - self.lowest, 0.0)

    def rises(self, costs: Costs) -> Costs:
        """The rise (S − S_min)/σ² of some costs S/2; NaN if one is not finite."""
        return np.where(np.isfinite(costs), 2 * (costs - self.lowest) / self.variance, np.nan)

    def heights(self, costs: Costs) -> Costs:
        """√((S − S_min)/σ²) of some costs S/2; NaN if one is not finite, or is lower than that of
        the estimate.
        """
        rises = self.rises(costs)
        return np.sqrt(np.maximum(np.where(rises > -_LOWER, rises, np.nan), 0))

    def points(self, places: Rows, active: Mask) -> Points:
        """Points with their linear models."""
        models = self.search.linearised(self.problem, Searches(places, active, self._parts))
        return self._around(places, models, active)

    def minima(self, starts: Rows, active: Mask) -> Points:
        """The minimum from each start. If a Gauss-Newton step promises nothing that matters, the
        minimum of the linear model counts as found. A few such steps come first, and searches where
        they are too long, gain nothing or do not end.
        """
        low, high, longest = self.limits.T
        starts = np.where(active, np.clip(starts, low, high), starts)
        best = self.points(starts, active)
        going = np.arange(len(starts))
        left = np.zeros(len(starts), bool)
        for turn in range(_STEPS):
            now = taken(best, going)
            with np.errstate(invalid="ignore"):  # a place at infinity has no step
                steps = np.clip(-now.solved(now.gradient), low - now.u, high - now.u)
            gains, near = now.decrease(steps), (np.abs(steps) <= longest).all(axis=1)
            fine = np.isfinite(now.cost) & (gains >= 0)
            done = fine & (gains <= self.enough(now.cost))
            short = done & (np.abs(steps) <= _SHORT * longest).all(axis=1)
            best = best.replaced(going[short], taken(now.stepped(steps), short))
            more = fine & near & ~done & (turn < _STEPS - 1)
            left[going[~done & ~more]] = True
            going, steps = going[more], steps[more]
            if not len(going):
                break
            trial = self.points(best.u[going] + steps, active[going])
            lower = trial.cost < best.cost[going]
            best = best.replaced(going[lower], taken(trial, lower))
            left[going[~lower]] = True
            going = going[lower]
        if left.any():
            best = best.replaced(left, self.searched(best.u[left], active[left]))
        return best

    def with_search(self, search: Search) -> "Refits":
        """Refits by another search."""
        return dataclasses.replace(self, search=search)

    def searched(self, starts: Rows, active: Mask) -> Points:
        """The minimum from each start by a search."""
        matters = _ENOUGH * self.variance / self.lowest if self.lowest > 0 else 0.0
        reduction = max(self.optimiser.reduction, matters / 10)
        rough = dataclasses.replace(self.optimiser, reduction=reduction)
        minima = self.search.minima(self.problem, rough, Searches(starts, active, self._parts))
        return self._around(np.asarray(minima.u), minima.model, active)

    def _around(self, places: Rows, models: Linearisation, active: Mask) -> Points:
        factor, rest = np.asarray(models.factor), np.asarray(models.rest)
        gradient = np.einsum("nij,ni->nj", factor, rest)
        hessian = np.einsum("nki,nkj->nij", factor, factor)
        cost = np.asarray(models.cost)
        known = np.isfinite(cost) & np.isfinite(hessian).all(axis=(1, 2))
        cost = np.where(known, cost, np.inf)
        gradient = np.where(known[:, None], gradient, 0.0)
        hessian = np.where(known[:, None, None], hessian, 0.0)
        low, high = self.limits[:, 0], self.limits[:, 1]
        outwards = ((places <= low) & (gradient > 0)) | ((places >= high) & (gradient < 0))
        return Points(places, cost, gradient, hessian, active & ~outwards)

    @property
    def limits(self) -> Float[np.ndarray, "parameters 3"]:
        """Ends of the coordinates, and their longest steps."""
        return np.array([limits(allowed) for allowed in self.ranges])

    @property
    def _parts(self) -> Bool[np.ndarray, "parts observations"]:
        """The whole record, as often as a fit has horizons, to share its compiled program."""
        return np.tile(np.asarray(self.problem.valid), (len(self.optimiser.horizons), 1))


def taken(points: Points, at: np.ndarray | Sequence[int]) -> Points:
    return Points(*(x[at] for x in points))


def refits_of(estimate: Estimate[P], optimiser: LevenbergMarquardt, search: Search) -> Refits:
    """Refits of an estimate."""
    lowest = float(np.nanmin(estimate.start_costs))
    known, weight = estimate.problem.variance(), estimate.problem.prior_weight()
    left = int(estimate.problem.observations) - len(estimate.names)
    deviations = estimate.problem.prior_rows(np.asarray(estimate.values)).squares
    squares = 2 * lowest - (0.0 if weight is None else float(weight * deviations))
    variance = squares / left if known is None else float(known)
    ranges = tuple(estimate.problem.ranges())
    return Refits(estimate.problem.padded(), optimiser, search, lowest, variance, ranges)
