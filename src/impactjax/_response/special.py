"""Special points of branches of orbits: functions that change sign there.

All are smooth along the branch. Those of fold, period doubling and grazing are so also at a
grazing, where multipliers are infinite:

- fold: component of the tangent along the parameter.
- period doubling: det(inner − wrap), which is zero if a disturbance that changes its sign in a
  period solves the linearised equations.
- Neimark-Sacker: product of μᵢ μⱼ − 1 over all pairs of multipliers but that of a shift in time.
- grazing: speed at which the guard of an event falls, or local minimum of a guard.
- onset of sticking: duration of the rest that follows a complete chatter. It is as exact as the sum
  of the chatter: the more impacts are before the sum, the better.
"""

import enum
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from impactjax._hybrid.equations import NO_EVENT
from impactjax._known import AnyArray
from impactjax._response.linear import Linear, Vector
from impactjax._response.point import Point

_REAL = 1e-6  # imaginary part up to which a multiplier is real
_EQUAL = 1e-4  # difference of two halves of an orbit that are the same

Values = Float[np.ndarray, " values"]


class Kind(enum.Enum):
    """Kind of a special point of a branch, with its name as value."""

    FOLD = "fold"
    PERIOD_DOUBLING = "period doubling"
    NEIMARK_SACKER = "Neimark-Sacker"
    GRAZING = "grazing"
    STICKING = "onset of sticking"
    OTHER_EVENTS = "another itinerary"
    RANGE = "end of the range"


class Special(NamedTuple):
    """Special point of a branch.

    - `ends`: true if the branch ends there.
    """

    kind: Kind
    point: Point
    ends: bool


def signed(kind: Kind) -> bool:
    """True for functions that are positive on the branch, which ends where they become negative:
    orbits beyond are no motions, or not asked for.
    """
    return kind in (Kind.GRAZING, Kind.STICKING, Kind.OTHER_EVENTS, Kind.RANGE)


def values_at(point: Point, sizes: Vector, between: tuple[float, float]) -> dict[Kind, Values]:
    """The functions of a point, one array for each kind."""
    linear, (low, high) = point.linear, between
    pieces, cycle = linear.pieces, linear.cycle
    own = (cycle.itinerary.event != NO_EVENT) & ~cycle.itinerary.at_once
    flips = (linear.inner - linear.wrap) * sizes[:-1] / linear.row_sizes(sizes)[:, None]
    durations, rests = cycle.arcs(linear.unknowns).d, np.roll(pieces.wait != 0, 1)
    kept = np.where(pieces.kept, 1.0, -1.0)
    parameter = linear.unknowns[-1]
    return {
        Kind.FOLD: point.tangent[-1:],
        Kind.PERIOD_DOUBLING: np.array([np.linalg.det(flips)]),
        Kind.NEIMARK_SACKER: np.array([_pairs(linear.transverse())]),
        Kind.GRAZING: np.concatenate([-pieces.fall[own], _or_one(pieces.least)]),
        Kind.STICKING: durations[own & rests],
        Kind.OTHER_EVENTS: np.concatenate([durations[own & ~rests], _or_one(pieces.others), kept]),
        Kind.RANGE: np.array([parameter - low, high - parameter]),
    }


def special(kind: Kind, point: Point, sizes: Vector) -> Special | None:
    """The special point at a zero of a function; `None` if the zero is none."""
    if kind == Kind.NEIMARK_SACKER and not _is_rotation(point.linear):
        return None
    if kind == Kind.FOLD and is_repeated(point, sizes):
        return Special(Kind.PERIOD_DOUBLING, point, True)
    return Special(kind, point, signed(kind))


def _or_one(guards: Float[AnyArray, "segments guards"]) -> Values:
    """Guards in one row, with 1 for those that have no minimum, or do not count."""
    return np.where(np.isfinite(guards), guards, 1.0).ravel()


def _pairs(multipliers: Complex[np.ndarray, " numbers"]) -> float:
    pairs = [a * b - 1 for a, b in combinations(multipliers, 2)]
    return float(np.prod(pairs).real) if pairs else 1.0


def _is_rotation(linear: Linear) -> bool:
    """True if two multipliers that are not real lie on the unit circle."""
    found = linear.transverse()
    complex_ones = found[np.abs(np.imag(found)) > _REAL]
    return bool(np.any(np.abs(np.abs(complex_ones) - 1) < _REAL))


def is_repeated(point: Point, sizes: Vector) -> bool:
    """True if an orbit is one of half its period, taken twice."""
    cycle = point.linear.cycle
    if cycle.multiple % 2 or cycle.segments % 2:
        return False
    y, size = cycle.arcs(point.linear.unknowns).y, cycle.arcs(sizes).y
    halves = np.split(y / size, 2)
    return bool(np.max(np.abs(halves[0] - halves[1])) < _EQUAL)
