"""Curves of conditional minima: points along them, each started from its neighbours.

Between known points the others follow a cubic polynomial with the right slopes. A point that fails,
or lies above what the quadratic model around a neighbour promises, is fitted again from there, so
that curves follow the lowest of several minima.
"""

import abc
import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from impactjax._fit.refits import Column, Costs, Mask, Points, Refits, Rows
from impactjax._identify.profile_axis import Axis

_ROUNDS = 8  # most rounds of refits from neighbours
_LOWER = 10.0  # difference of costs that leads to another refit, relative to their error
_STAGES = (0.2, 1.0)  # shares of the points that are found together
_SAME = 1e-9  # distance of places that count as one

Which = Int[np.ndarray, " lanes"]
Places = Float[np.ndarray, "_"]


class Knots(NamedTuple):
    """Points of a curve, at distances x along its axis.

    - `u`, `cost`: coordinates of a search and cost, infinite if the fit failed.
    - `tangent`: derivatives of the coordinates by x.
    - `slope`, `bend`: first and second derivative of the cost by x.
    """

    x: Column
    u: Rows
    cost: Column
    tangent: Rows
    slope: Column
    bend: Column

    def taken(self, at: np.ndarray | Sequence[int] | slice) -> "Knots":
        """Some of the points."""
        return Knots(*(each[at] for each in self))

    @property
    def finite(self) -> "Knots":
        """The points at which the fit did not fail."""
        return self.taken(np.isfinite(self.cost))

    def start(self, x: Places) -> Rows:
        """Coordinates between the points by Hermite's cubic polynomials, beyond them by tangents;
        all are finite.
        """
        right = np.clip(np.searchsorted(self.x, x), 1, max(len(self.x) - 1, 1))
        left = right - 1
        right = np.minimum(right, len(self.x) - 1)
        width = np.maximum(self.x[right] - self.x[left], _SAME)[:, None]
        inside = np.clip(x, self.x[0], self.x[-1])
        t = (inside - self.x[left])[:, None] / width
        first, last = self.tangent[left] * width, self.tangent[right] * width
        cubic = (1 + 2 * t) * (1 - t) ** 2 * self.u[left] + t**2 * (3 - 2 * t) * self.u[right]
        cubic += t * (1 - t) ** 2 * first - t**2 * (1 - t) * last
        nearest = np.where((x > inside)[:, None], self.tangent[right], self.tangent[left])
        return cubic + nearest * (x - inside)[:, None]


def knots_along(x: Column, points: Points, directions: Rows) -> Knots:
    """Conditional minima as points of curves, with the changes of the held parameters by x."""
    tangent = points.along(directions)
    slope = (points.gradient * tangent).sum(axis=1)
    bend = np.einsum("ni,nij,nj->n", tangent, points.hessian, tangent)
    return Knots(x, points.u, points.cost, tangent, slope, bend)


def merged(*several: Knots) -> Knots:
    """Points of one curve in their order, the first of equal ones."""
    every = Knots(*(np.concatenate(each) for each in zip(*several, strict=True)))
    order = np.argsort(every.x, kind="stable")
    ordered = every.taken(order)
    return ordered.taken(np.diff(ordered.x, prepend=-np.inf) > _SAME)


class AbstractCurves(abc.ABC):
    """A family of curves of conditional minima."""

    @abc.abstractmethod
    def refitted(self, which: Which, x: Column, starts: Rows) -> Knots:
        """Points of some curves at distances x, from starts close to them."""

    @abc.abstractmethod
    def enough(self, costs: Costs) -> Costs:
        """Errors of some costs that do not matter."""


@dataclasses.dataclass(frozen=True)
class HeldParameters(AbstractCurves):
    """Curves along which parameters are held.

    - `refits`: the refits.
    - `parameters`, `axes`: for each curve, the parameter that is held, and its axis.
    - `active`: masks of the parameters that are fitted; another one may be held at its start.
    """

    refits: Refits
    parameters: Sequence[int]
    axes: Sequence[Axis]
    active: Mask

    def refitted(self, which: Which, x: Column, starts: Rows) -> Knots:
        held = np.array(self.parameters)[which]
        places, directions = starts.copy(), np.zeros_like(starts)
        for curve in np.unique(which):
            own, axis = which == curve, self.axes[curve]
            places[own, held[own]] = axis.coordinate(x[own])
            directions[own, held[own]] = axis.rate(x[own])
        return knots_along(x, self.refits.minima(places, self.active[which]), directions)

    def enough(self, costs: Costs) -> Costs:
        return self.refits.enough(costs)


def filled(curves: AbstractCurves, known: Sequence[Knots], places: Sequence[Places]) -> list[Knots]:
    """Points of each curve at some places, started between its known points."""
    counts = [len(x) for x in places]
    which, x = np.repeat(np.arange(len(places)), counts), np.concatenate(list(places))
    if not len(x):
        return [own.taken([]) for own in known]
    starts = [own.start(at) for own, at in zip(known, places, strict=True)]
    found = curves.refitted(which, x, np.concatenate(starts))
    return [found.taken(which == curve) for curve in range(len(places))]


def mended(curves: AbstractCurves, knots: Sequence[Knots]) -> list[Knots]:
    """The points, fitted again where a neighbour promises a lower cost, until none does."""
    counts = [len(each.x) for each in knots]
    which, every = np.repeat(np.arange(len(counts)), counts), _together(knots)
    fresh = np.ones(len(which), bool)
    for _ in range(_ROUNDS):
        source = _better_neighbour(curves, which, every, fresh)
        at = np.flatnonzero(source >= 0)
        if not len(at):
            break
        origin = every.taken(source[at])
        starts = origin.u + origin.tangent * (every.x[at] - origin.x)[:, None]
        found = curves.refitted(which[at], every.x[at], starts)
        old = every.taken(at).cost
        seen = np.where(np.isfinite(old), old, 0.0)
        lower = found.cost < np.where(np.isfinite(old), seen - curves.enough(seen), np.inf)
        for field, new in zip(every, found, strict=True):
            field[at[lower]] = new[lower]
        fresh = np.zeros(len(which), bool)
        fresh[at[lower]] = True
    return [every.taken(which == curve) for curve in range(len(counts))]


def _together(knots: Sequence[Knots]) -> Knots:
    return Knots(*(np.concatenate(each) for each in zip(*knots, strict=True)))


def _better_neighbour(
    curves: AbstractCurves, which: Which, every: Knots, fresh: Bool[np.ndarray, " lanes"]
) -> Which:
    """For each point the neighbour, fresh since the last round, whose quadratic model promises the
    lowest cost, if that is clearly lower than its own; else −1.
    """
    source, places = np.full(len(which), -1), np.arange(len(which))
    known = np.isfinite(every.cost)
    wanted = np.where(known, every.cost, 0.0)
    wanted = np.where(known, wanted - _LOWER * curves.enough(wanted), np.inf)
    for step in (-1, 1):
        other = np.clip(places + step, 0, len(which) - 1)
        allowed = (which[other] == which) & (other != places) & fresh[other] & known[other]
        away = every.x - every.x[other]
        cost = np.where(known[other], every.cost[other], 0.0)
        promised = cost + every.slope[other] * away + every.bend[other] * away**2 / 2
        better = allowed & (promised < wanted)
        source, wanted = np.where(better, other, source), np.where(better, promised, wanted)
    return source


class Span(NamedTuple):
    """The part of a curve that is wanted.

    - `low`, `high`: its ends.
    - `lowest`, `unit`: cost of the estimate, and the rise of the cost at the ends of the interval.
    """

    low: float
    high: float
    lowest: float
    unit: float


def traced(
    curves: AbstractCurves,
    known: Sequence[Knots],
    spans: Sequence[Span],
    count: int,
    kept: Sequence[Knots],
) -> list[Knots]:
    """Some points of each curve, denser where it is steep. Kept ones are among them.

    **Arguments:**

    - `known`: points of each curve, among them the estimate at x = 0.
    - `spans`: the parts that are wanted.
    - `count`: number of points.
    - `kept`: points that are not fitted again.
    """
    ends = [np.array([x for x in (each.low, each.high) if x != 0]) for each in spans]
    missing = [x[~_among(x, old.x)] for x, old in zip(ends, kept, strict=True)]
    first = filled(curves, [each.finite for each in known], missing)
    centres = [own.taken(np.abs(own.x) <= _SAME) for own in known]
    shown = [merged(*each) for each in zip(kept, first, centres, strict=True)]
    for share in _STAGES:
        total = max(round(share * count), 0)
        known = [merged(a.finite, b.finite) for a, b in zip(shown, known, strict=True)]
        rows = zip(shown, known, spans, strict=True)
        places = [_between(each.x, own, span, total) for each, own, span in rows]
        new = filled(curves, known, places)
        shown = [merged(*each) for each in zip(shown, new, strict=True)]
    return mended(curves, shown)


def _among(x: Places, others: Column) -> Bool[np.ndarray, " points"]:
    return np.asarray(np.isclose(x[:, None], others, rtol=0, atol=_SAME).any(axis=1))


def _between(shown: Column, known: Knots, span: Span, count: int) -> Places:
    """Places between those that are shown, which make up `count` with them: the longest pieces of
    the curve of √rise are divided.
    """
    if len(shown) < 2 or len(shown) >= count:
        return np.zeros(0)
    height = np.sqrt(np.maximum(known.cost - span.lowest, 0) / span.unit)
    across = np.diff(known.x) / (shown[-1] - shown[0])
    length = np.concatenate([[0.0], np.cumsum(np.hypot(across, np.diff(np.minimum(height, 2))))])
    ends = np.interp(shown, known.x, length)
    gaps, parts = np.diff(ends), np.ones(len(shown) - 1, int)
    for _ in range(count - len(shown)):
        parts[np.argmax(gaps / parts)] += 1
    pieces = [
        np.linspace(a, b, n + 1)[1:-1] for a, b, n in zip(ends[:-1], ends[1:], parts, strict=True)
    ]
    return np.interp(np.concatenate(pieces), length, known.x)
