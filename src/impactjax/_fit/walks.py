"""Walks from an estimate to the ends of its intervals, with the refits on the way."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.profile_walk import FARTHEST, Walk
from impactjax._fit.refits import Points, Refits, taken
from impactjax._fit.straight import Straight, straight

_ROUNDS = 12  # most refits on one side
_HIGH = 2.0  # rise of another minimum, relative to the limit, from which no walk begins there
_NEAR = 4.0  # distance of zero from a positive parameter, in errors, that is near

Vector = Float[np.ndarray, " parameters"]


class Local(NamedTuple):
    """An estimate in linear approximation, in straight coordinates."""

    coordinates: Straight
    values: Vector
    covariance: Float[np.ndarray, "parameters parameters"]

    def error(self, parameter: int) -> float:
        """The standard error of a coordinate; its size if that is infinite."""
        error = math.sqrt(float(self.covariance[parameter, parameter]))
        return error if math.isfinite(error) else max(abs(float(self.values[parameter])), 1e-6)

    def is_scale(self, parameter: int) -> bool:
        """True for a positive parameter whose range ends within four errors: distances are
        differences of its natural logarithm.
        """
        allowed = self.coordinates.ranges[parameter]
        positive = allowed.excludes_low and allowed.low == 0
        return positive and self.error(parameter) > float(self.values[parameter]) / _NEAR


def local(estimate: Estimate[P]) -> Local:
    """The linear approximation of an estimate."""
    values, own = np.asarray(estimate.values), straight(estimate.problem)
    slopes = own.slopes(values)
    covariance = np.asarray(estimate.covariance) / np.outer(slopes, slopes)
    return Local(own, own.places(values), covariance)


class Tried(NamedTuple):
    """A refit of a walk: the parameter, its straight coordinate that was held, and the result."""

    parameter: int
    value: float
    points: Points


def begun(estimate: Estimate[P], around: Local, parameter: int, side: int, limit: float) -> Walk:
    """A walk from the estimate towards the rise `limit`, in units without correlation."""
    allowed, centre = around.coordinates.ranges[parameter], float(around.values[parameter])
    error, logarithmic = around.error(parameter), around.is_scale(parameter)
    room = (centre - allowed.low) if side < 0 else (allowed.high - centre)
    power = around.coordinates.powers[parameter]
    farthest = FARTHEST * min(abs(power), 1.0) if logarithmic else room / error
    limit *= max(float(np.asarray(estimate.inflation)[parameter]), 1.0)
    walk = Walk(parameter, side, centre, error, logarithmic, farthest, limit)
    walk.done = farthest <= 0 or not math.isfinite(float(estimate.rms))
    return walk


def walked(
    estimate: Estimate[P], refits: Refits, around: Local, walks: Sequence[Walk]
) -> list[Tried]:
    """Takes the walks to their ends, and returns their refits."""
    centres, tried = [around], []
    if any(around.coordinates.fades):
        faded, rise = _faded(estimate, refits, around)
        if not rise > _HIGH * max((walk.limit for walk in walks), default=math.inf):
            centres.append(faded)
        for walk in walks:
            walk.include(float(faded.values[walk.parameter]), rise)
    for _ in range(_ROUNDS):
        going = [walk for walk in walks if not walk.done]
        if not going:
            break
        held = [walk.next_value() for walk in going]
        points, rises = _lowest(refits, centres, going, held)
        for i, (walk, value) in enumerate(zip(going, held, strict=True)):
            tried.append(Tried(walk.parameter, value, taken(points, [i])))
            walk.learn(float(rises[i]))
    return tried


def _lowest(
    refits: Refits, centres: Sequence[Local], walks: list[Walk], held: list[float]
) -> tuple[Points, Float[np.ndarray, " walks"]]:
    """The lowest of the refits that begin around each centre, and its √((S − S_min)/σ²): NaN if all
    failed, or if it is lower than the estimate.
    """
    each = [(own, *pair) for own in centres for pair in zip(walks, held, strict=True)]
    starts = np.array([own.coordinates.values(_start(own, w, v)) for own, w, v in each])
    lowest, highest = refits.limits[:, 0], refits.limits[:, 1]
    places = np.clip(refits.problem.coordinates(starts), lowest, highest)
    active = np.ones(places.shape, bool)
    active[np.arange(len(each)), [walk.parameter for _, walk, _ in each]] = False
    found = refits.minima(places, active)
    costs = found.cost.reshape(len(centres), len(walks))
    heights = refits.heights(costs)
    best = np.where(np.isnan(costs), np.inf, costs).argmin(axis=0)
    points = taken(found, best * len(walks) + np.arange(len(walks)))
    return points, heights[best, np.arange(len(walks))]


def _faded(estimate: Estimate[P], refits: Refits, around: Local) -> tuple[Local, float]:
    """The minimum where the effects of parameters that fade have vanished, and its rise. It may be
    another one than the estimate.
    """
    problem, fades = refits.problem, np.array(around.coordinates.fades)
    start = np.where(fades, refits.limits[:, 0], problem.coordinates(np.asarray(estimate.values)))
    found = refits.minima(start[None], ~fades[None])
    values = around.coordinates.places(np.asarray(problem.at(found.u[0])))
    slopes = np.where(fades, 0.0, np.asarray(estimate.jacobian))
    norms = np.linalg.norm(slopes, axis=0)
    sizes = np.where(norms > 0, norms, 1.0)
    scaled = slopes / sizes
    covariance = np.linalg.pinv(scaled.T @ scaled, hermitian=True) / np.outer(sizes, sizes)
    there = Local(around.coordinates, values, covariance)
    return there, float(refits.heights(found.cost)[0])


def _start(local: Local, walk: Walk, value: float) -> Vector:
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
