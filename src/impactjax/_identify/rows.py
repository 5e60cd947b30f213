"""Rows of a ridge: curves across the valley of the sum of squares."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._fit.refits import Column, Refits
from impactjax._fit.straight import raised
from impactjax._fit.walks import Local
from impactjax._identify.curves import (
    HeldParameters,
    Knots,
    Span,
    filled,
    mended,
    merged,
    traced,
)
from impactjax._identify.profile_axis import Axis, axis_of
from impactjax._optimise.coordinates import to_value

_BEYOND = 1.25  # distance to which a row goes, relative to that of the edge of the region
_LEAST, _MOST = 1.1, 1.7  # relative √rise at its ends with which that is found
_WIDEST = 4.0  # the farthest, in standard errors of the estimate or differences of the logarithm
_FEW = 21  # rows that are found first
_ROUNDS = 6  # of changes of the width
_INSIDE = 0.999  # share of the way to an end that is not allowed

Ends = Float[np.ndarray, "rows 2"]


class Rows(NamedTuple):
    """Rows across a valley.

    - `floor`: points of the valley, one a row.
    - `axes`, `spans`, `knots`: of each row.
    """

    floor: Knots
    axes: tuple[Axis, ...]
    spans: tuple[Span, ...]
    knots: tuple[Knots, ...]


def row_curves(refits: Refits, pair: Sequence[int], axes: Sequence[Axis]) -> HeldParameters:
    """The curves along the second parameter of a pair, with the first one held as well."""
    active = ~np.isin(np.arange(len(refits.ranges)), pair)
    many = np.tile(active, (len(axes), 1))
    return HeldParameters(refits, [pair[1]] * len(axes), axes, many)


def rows_of(
    refits: Refits,
    around: Local,
    pair: Sequence[int],
    floor: Knots,
    unit: float,
    count: int,
    known: Rows | None,
) -> Rows:
    """Rows of `count` points across a valley, as wide as the region whose edge is where the cost
    rises by `unit`. Known rows are kept and completed, or else some are found first; the others are
    started between them.
    """
    if known is None:
        few = np.unique(np.linspace(0, len(floor.x) - 1, _FEW).round().astype(int))
        first = _first_rows(refits, around, pair, floor.taken(few), unit)
    else:
        few = np.flatnonzero(np.isin(floor.x, known.floor.x))
        first = known
    curves = row_curves(refits, pair, first.axes)
    kept = [
        each.taken((each.x >= span.low) & (each.x <= span.high))
        for each, span in zip(first.knots, first.spans, strict=True)
    ]
    traces = traced(curves, first.knots, first.spans, count, kept)
    first = first._replace(knots=tuple(_level(each, count) for each in traces))
    left = np.setdiff1d(np.arange(len(floor.x)), few)
    if not len(left):
        return first
    further = _between(refits, pair, first, floor.taken(left))
    order = np.argsort(np.concatenate([few, left]), kind="stable")
    each = zip(first[1:], further[1:], strict=True)
    parts = [tuple((*a, *b)[i] for i in order) for a, b in each]
    return Rows(floor, *parts)


def _level(row: Knots, count: int) -> Knots:
    """A row with so many points; the last one is repeated where places coincide."""
    return row.taken(np.minimum(np.arange(max(count, len(row.x))), len(row.x) - 1))


def _between(refits: Refits, pair: Sequence[int], first: Rows, floor: Knots) -> Rows:
    """Rows between others, whose points start on curves through theirs, by Akima's method."""
    from scipy.interpolate import Akima1DInterpolator

    def along(values: np.ndarray) -> np.ndarray:
        return Akima1DInterpolator(first.floor.x, values)(floor.x)

    usual, count = first.axes[0], len(floor.x)
    centres = _centres(refits, usual, floor.u[:, pair[1]], pair[1])
    scales = np.exp(along(np.log([axis.unit for axis in first.axes])))
    axes = [
        usual._replace(centre=float(centre), unit=float(scale))
        for centre, scale in zip(centres, scales, strict=True)
    ]
    x = np.maximum.accumulate(along(np.stack([row.x for row in first.knots])), axis=1)
    u = along(np.stack([row.u for row in first.knots]))
    u[:, :, pair[0]] = floor.u[:, None, pair[0]]
    which = np.repeat(np.arange(count), x.shape[1])
    curves = row_curves(refits, pair, axes)
    found = curves.refitted(which, x.reshape(-1), u.reshape(len(which), -1))
    knots = mended(curves, [found.taken(which == row) for row in range(count)])
    example = first.spans[0]
    spans = [example._replace(low=float(own[0]), high=float(own[-1])) for own in x]
    return Rows(floor, tuple(axes), tuple(spans), tuple(knots))


def _centres(refits: Refits, axis: Axis, u: Column, parameter: int) -> Column:
    """The power of the second parameter in the valley that is held."""
    return raised(to_value(refits.ranges[parameter], u), axis.allowed.power)


def _first_rows(
    refits: Refits, around: Local, pair: Sequence[int], floor: Knots, unit: float
) -> Rows:
    """Rows with their centres and ends."""
    usual, every = axis_of(around, pair[1]), np.arange(len(floor.x))
    centres = _centres(refits, usual, floor.u[:, pair[1]], pair[1])
    axes = [usual._replace(centre=float(centre)) for centre in centres]
    middle = row_curves(refits, pair, axes).refitted(every, np.zeros(len(every)), floor.u)
    bend = np.maximum(middle.bend, 2 * unit / _WIDEST**2)
    widths = np.sqrt(2 * unit / bend)  # distance at which the rise reaches the edge
    scales = np.ones(len(axes)) if usual.logarithmic else widths
    axes = [axis._replace(unit=axis.unit * scale) for axis, scale in zip(axes, scales, strict=True)]
    middle = middle._replace(
        tangent=middle.tangent * scales[:, None],
        slope=middle.slope * scales,
        bend=middle.bend * scales**2,
    )
    knots = [middle.taken(slice(i, i + 1)) for i in every]
    far = np.stack([_farthest(axis, scale) for axis, scale in zip(axes, scales, strict=True)])
    wanted = np.clip(np.outer(_BEYOND * widths / scales, [-1.0, 1.0]), far[:, :1], far[:, 1:])
    curves = row_curves(refits, pair, axes)
    knots, ends = _widened(curves, knots, wanted, far, refits.lowest, unit)
    spans = [Span(float(low), float(high), refits.lowest, unit) for low, high in ends]
    return Rows(floor, tuple(axes), tuple(spans), tuple(knots))


def _farthest(axis: Axis, scale: float) -> tuple[float, float]:
    """The ends of the range on an axis, at most some standard errors away."""
    widest = _WIDEST if axis.logarithmic else _WIDEST / scale
    ends = [-widest, widest]
    if not axis.logarithmic:
        low, high = axis.straight.low, axis.straight.high
        share = _INSIDE if axis.straight.excludes_low else 1.0
        ends[0] = max(ends[0], share * (low - axis.centre) / axis.unit)
        ends[1] = min(ends[1], (high - axis.centre) / axis.unit)
    return ends[0], ends[1]


def _widened(
    curves: HeldParameters,
    knots: list[Knots],
    wanted: Ends,
    far: Ends,
    lowest: float,
    unit: float,
) -> tuple[list[Knots], Ends]:
    """The points of each row with its ends, moved until these are just outside the region."""
    deep = np.array([[float(each.cost[0]) - lowest < unit] for each in knots])
    side, most = np.array([-1.0, 1.0]), np.abs(far)
    inner, outer, at = np.zeros(wanted.shape), np.full(wanted.shape, np.inf), np.abs(wanted)
    going = np.ones(wanted.shape, bool)
    for _ in range(_ROUNDS):
        places = [(side * row)[on & (row > 0)] for row, on in zip(at, going, strict=True)]
        new = filled(curves, [each.finite for each in knots], places)
        knots = [merged(*each) for each in zip(knots, new, strict=True)]
        costs = np.stack([_costs(each, side * x) for each, x in zip(knots, at, strict=True)])
        height = np.sqrt(np.maximum(costs - lowest, 0) / unit)
        low, high = height < _LEAST, ~(height <= _MOST)
        inner, outer = np.where(going & low, at, inner), np.where(going & high, at, outer)
        farther = np.minimum(at * np.clip(_BEYOND / np.maximum(height, 0.1), 1.2, 3.0), most)
        nearer = at * np.clip(_BEYOND / np.maximum(height, 0.1), 0.2, 0.8)
        between = np.where(inner > 0, (inner + np.where(high, outer, inner)) / 2, nearer)
        between = np.where(low, (inner + outer) / 2, between)
        after = np.where(low & np.isinf(outer), farther, between)
        going = (low | high) & deep & (after != at)
        if not going.any():
            break
        at = np.where(going, after, at)
    # An end that is not found lies outside the region rather than inside.
    return knots, side * np.where(going & np.isfinite(outer), outer, at)


def _costs(knots: Knots, x: Column) -> Column:
    """The costs at some of the points."""
    return knots.cost[np.abs(knots.x[:, None] - x).argmin(axis=0)]
