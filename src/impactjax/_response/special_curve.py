"""The verb `special_curve`: special point of a branch → curve of such points in two parameters.

At a value of the second parameter the branch of orbits is followed in the first one, and the kind
of a point is a function F that vanishes there (see `special.py`). In the plane of the place s along
that branch and the second parameter, the curve is F = 0. A step goes along it, and then across it
by the secant method, to rounding. Since s, and not the first parameter, is a coordinate, curves of
folds go smoothly through their cusps.

Source: W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, for
test functions and their curves.
"""

from collections.abc import Iterator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from impactjax._refusal import check_kind, check_number, whole
from impactjax._response.branch import SpecialPoint
from impactjax._response.linear import Linear, Vector
from impactjax._response.newton import sizes_of
from impactjax._response.orbit import Orbit, orbit_of
from impactjax._response.parameter import Where, place_of, range_of, with_value
from impactjax._response.point import Point, corrected, first_point
from impactjax._response.special import Kind, is_repeated, signed, values_at

_NEAR = 1e-4  # difference for the slopes of F, in units of the ranges
_ITERATIONS = 12  # of the secant method
_EXACT = 1e-13  # its last step
_LEAST = 1e-4  # step, relative to the longest, below which the curve is lost
_FIRST = 0.2  # first step, relative to the longest
_BENT = 0.5  # largest step across the curve, relative to that along it
_STRAIGHT = 0.05  # the same, below which the step grows
_GROW, _SHRINK = 1.5, 0.5
_ZERO = 1e-9  # up to this, a function counts as zero; of several, the first one is smooth
_MOTION = -1e-9  # functions that are positive for a motion, up to rounding

Coordinates = Float[np.ndarray, "2"]


class SpecialCurve(eqx.Module):
    """Curve of special points of one kind in two parameters, in order along it.

    - `kind`: as of a `SpecialPoint`.
    - `first`, `second`: values of the parameters: that of the branch, and the other one.
    - `period`: period of each orbit.
    - `multipliers`: Floquet multipliers, the largest first.
    - `complete`: true if both ends are ends of the range of the second parameter. Otherwise the
      first one leaves its range there, the orbits beyond are no motions, the number of points did
      not suffice, or Newton's method has lost the curve.
    """

    kind: str
    first: Float[np.ndarray, " points"]
    second: Float[np.ndarray, " points"]
    period: Float[np.ndarray, " points"]
    multipliers: Complex[np.ndarray, "points numbers"]
    complete: bool
    linears: tuple[Linear, ...]
    sizes: Vector

    def orbit(self, index: int) -> Orbit:
        """The orbit at a point."""
        return orbit_of(self.linears[index], self.sizes, True)


def special_curve(
    special: SpecialPoint,
    where: Where,
    between: tuple[float, float],
    first_between: tuple[float, float],
    *,
    longest: float = 0.05,
    max_points: int = 200,
) -> SpecialCurve:
    """Follows a special point of a branch in a second parameter, to both sides.

    The curve ends where a parameter leaves its range and where the orbits are no motions, as beyond
    a grazing. Each point is one of its kind to rounding.

    **Arguments:**

    - `special`: a fold, period doubling, Neimark-Sacker point or grazing of `branch.special`.
    - `where`: selects the second parameter, one number of the system.
    - `between`, `first_between`: least and largest value of the second parameter and of the first.
    - `longest`: longest step, in units in which both ranges, the period, and the largest values of
      the state are 1.
    - `max_points`: largest number of points to each side.

    **Raises** `ValueError` for another kind, for the point at which a branch of doubled orbits
    begins, a parameter that is not one real number or that of the branch, and a range without its
    value; `TypeError` for arguments of the wrong type.
    """
    check_kind("special", special, SpecialPoint, "branch.special[0]")
    kind = Kind(special.kind)
    if kind in (Kind.RANGE, Kind.OTHER_EVENTS):
        raise ValueError(
            f"Argument `special` is of the kind `{kind.value}`; there are curves of folds, period "
            "doublings, Neimark-Sacker points and grazings."
        )
    check_number("longest", longest)
    if not 0 < longest < np.inf:
        raise ValueError(f"Argument `longest` must be positive and finite, but it is {longest}.")
    linear, count = special.orbit.linear, whole("max_points", max_points)
    leaf = _leaf(linear, where)
    ranges = (
        range_of("first_between", first_between, float(linear.unknowns[-1])),
        range_of("between", between, _second(linear, leaf)),
    )
    sizes = sizes_of(linear, ranges[0][1] - ranges[0][0])
    begin = first_point(linear, sizes)
    if is_repeated(begin, sizes):
        raise ValueError(
            "Argument `special` is where the branch meets that of orbits with half the period: "
            "take this point from the branch of those."
        )
    values = np.abs(values_at(begin, sizes, ranges[0])[kind])
    number = int(np.argmax(values <= np.maximum(np.min(values), _ZERO)))
    task = _Task(kind, number, leaf, ranges, sizes)
    down, up = (list(_walked(task, begin, sign * longest, count)) for sign in (-1.0, 1.0))
    linears = tuple(point.linear for point in [*down[::-1], begin, *up])
    second = np.array([_second(each, leaf) for each in linears])
    return SpecialCurve(
        kind.value,
        np.array([each.unknowns[-1] for each in linears]),
        second,
        np.array([each.period for each in linears]),
        np.stack([each.multipliers() for each in linears]),
        bool(np.all(np.isin(second[[0, -1]], ranges[1]))),
        linears,
        sizes,
    )


class _Task(NamedTuple):
    """Kind, second parameter and ranges of a curve.

    - `number`: of the function that vanishes, among those of the kind.
    - `leaf`: index of the second parameter among the leaves of the system.
    - `ranges`: of both parameters.
    """

    kind: Kind
    number: int
    leaf: int
    ranges: tuple[tuple[float, float], tuple[float, float]]
    sizes: Vector

    @property
    def unit(self) -> float:
        """Length of the range of the second parameter."""
        low, high = self.ranges[1]
        return high - low

    def value(self, point: Point) -> float:
        """The function F."""
        return float(values_at(point, self.sizes, self.ranges[0])[self.kind][self.number])

    def is_motion(self, point: Point) -> bool:
        """True if the orbit of a point is a motion, or just grazes if that is its kind."""
        values = values_at(point, self.sizes, self.ranges[0])
        if signed(self.kind):
            values[self.kind] = np.delete(values[self.kind], self.number)
        each = [values[kind] for kind in Kind if signed(kind)]
        return bool(np.all(np.concatenate(each) > _MOTION))


def _leaf(linear: Linear, where: Where) -> int:
    """The index of the second parameter. Raises `ValueError` if it is that of the branch."""
    family = linear.cycle.family
    leaf = place_of(family.at(jnp.asarray(linear.unknowns[-1])), where)
    if np.any(np.asarray(jax.tree.leaves(family.along, is_leaf=_is_none)[leaf])):
        raise ValueError("Argument `where` selects the parameter of the branch: choose another.")
    return leaf


def _is_none(leaf: object) -> bool:
    return leaf is None


def _second(linear: Linear, leaf: int) -> float:
    """The second parameter of an orbit."""
    return float(jax.tree.leaves(linear.cycle.family.system)[leaf])


def _at(task: _Task, point: Point, s: float, second: float) -> Point | None:
    """The point at a place s along the branch of another one, for another value of the second
    parameter; `None` if Newton's method does not find it.
    """
    cycle = point.linear.cycle
    system = with_value(cycle.family.system, task.leaf, jnp.asarray(second))
    family = eqx.tree_at(lambda family: family.system, cycle.family, system)
    linear = point.linear._replace(cycle=cycle._replace(family=family))
    own = point._replace(linear=linear)
    return corrected(own, point.place + s * point.tangent, task.sizes, s)


def _walked(task: _Task, begin: Point, longest: float, count: int) -> Iterator[Point]:
    """The points of the curve on one side of the first, that of smaller second parameters for a
    negative `longest`.
    """
    point, direction = begin, np.array([0.0, np.sign(longest)])
    length, longest = _FIRST * abs(longest), abs(longest)
    for _ in range(count):
        slopes = _slopes(task, point)
        if slopes is None or not slopes.any():
            return
        along = np.array([-slopes[1], slopes[0]]) / np.hypot(*slopes)
        along = along * np.copysign(1.0, along @ direction)
        step: _Step | None = None
        while step is None and length > _LEAST * longest:
            tried = _stepped(task, point, along, slopes, length)
            step = tried if tried is not None and task.is_motion(tried.point) else None
            length *= _SHRINK if step is None else 1.0
        if step is None:
            return
        yield step.point
        if _second(step.point.linear, task.leaf) in task.ranges[1]:
            return
        point, direction = step.point, along
        if step.bend < _STRAIGHT:
            length = min(_GROW * length, longest)


def _slopes(task: _Task, point: Point) -> Coordinates | None:
    """Derivatives of F by s, and by the second parameter in units of its range, at a point of the
    curve, by differences.
    """
    now, found = _second(point.linear, task.leaf), []
    for s, change in ((_NEAR, 0.0), (0.0, _NEAR * task.unit)):
        before = _at(task, point, -s, now - change)
        after = _at(task, point, s, now + change)
        if before is None or after is None:
            return None
        found.append((task.value(after) - task.value(before)) / (2 * _NEAR))
    return np.array(found)


class _Step(NamedTuple):
    """A step along the curve, and how far it went across, relative to its length."""

    point: Point
    bend: float


def _stepped(
    task: _Task, point: Point, along: Coordinates, slopes: Coordinates, length: float
) -> _Step | None:
    """The point of the curve a length ahead, or at the end of the range of the second parameter;
    `None` if it is not found nearby.
    """
    (low, high), now = task.ranges[1], _second(point.linear, task.leaf)
    place, across = length * along, slopes / np.hypot(*slopes)
    end = ((high if along[1] > 0 else low) - now) / task.unit
    if abs(place[1]) >= abs(end):
        if end == 0:
            return None
        place, across = place * (end / place[1]), np.array([1.0, 0.0])
    old, x, known = 0.0, 0.0, None
    slope = float(slopes @ across)
    for _ in range(_ITERATIONS):
        s, change = place + x * across
        found = _at(task, point, s, float(np.clip(now + change * task.unit, low, high)))
        if found is None:
            return None
        value = task.value(found)
        slope = slope if known is None else (value - known) / (x - old)
        if value == 0 or abs(value) <= _EXACT * abs(slope):
            return _Step(found, abs(x) / length)
        if slope == 0 or not abs(x - value / slope) <= _BENT * length:
            return None
        old, x, known = x, x - value / slope, value
    return None
