"""A walk along a curve of special points in two parameters, to one side.

A step goes along the curve, and then across it by the secant method, to rounding. Coordinates are
the place s along the branch through a point, and the second parameter in units of its range.
"""

import enum
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from impactjax._response.linear import Linear, Vector
from impactjax._response.parameter import with_value
from impactjax._response.point import Point, corrected
from impactjax._response.special import Kind, signed, values_at

_NEAR = 1e-4  # difference for the slopes of F, in units of the ranges
_ITERATIONS = 12  # of the secant method
_EXACT = 1e-13  # its last step
_LEAST = 1e-4  # step, relative to the longest, below which the curve is lost
_FIRST = 0.2  # first step, relative to the longest
_BENT = 0.5  # largest step across the curve, relative to that along it
_STRAIGHT = 0.05  # the same, below which the step grows
_GROW, _SHRINK = 1.5, 0.5
_MOTION = -1e-9  # functions that are positive for a motion, up to rounding

Coordinates = Float[np.ndarray, "2"]


class End(enum.Enum):
    """Cause of the end of a curve, with its name as value."""

    RANGE = Kind.RANGE.value
    FIRST_RANGE = "end of the first range"
    GRAZING = Kind.GRAZING.value
    STICKING = Kind.STICKING.value
    OTHER_EVENTS = Kind.OTHER_EVENTS.value
    POINTS = "largest number of points"
    LOST = "lost by Newton's method"


_NO_MOTION = {
    Kind.GRAZING: End.GRAZING,
    Kind.STICKING: End.STICKING,
    Kind.OTHER_EVENTS: End.OTHER_EVENTS,
    Kind.RANGE: End.FIRST_RANGE,
}


class Task(NamedTuple):
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

    def end_at(self, point: Point) -> End | None:
        """Cause of an end before a point: its orbit is no motion within the range of the first
        parameter. `None` if it is one, or just grazes if that is its kind.
        """
        values = values_at(point, self.sizes, self.ranges[0])
        if signed(self.kind):
            values[self.kind] = np.delete(values[self.kind], self.number)
        ends = (end for kind, end in _NO_MOTION.items() if not np.all(values[kind] > _MOTION))
        return next(ends, None)


def second_of(linear: Linear, leaf: int) -> float:
    """The second parameter of an orbit."""
    return float(jax.tree.leaves(linear.cycle.family.system)[leaf])


def _at(task: Task, point: Point, s: float, second: float) -> Point | None:
    """The point at a place s along the branch of another one, for another value of the second
    parameter; `None` if Newton's method does not find it.
    """
    cycle = point.linear.cycle
    system = with_value(cycle.family.system, task.leaf, jnp.asarray(second))
    family = eqx.tree_at(lambda family: family.system, cycle.family, system)
    linear = point.linear._replace(cycle=cycle._replace(family=family))
    own = point._replace(linear=linear)
    return corrected(own, point.place + s * point.tangent, task.sizes, s)


def walked(task: Task, begin: Point, longest: float, count: int) -> tuple[list[Point], End]:
    """The points of the curve on one side of the first, that of smaller second parameters for a
    negative `longest`, and the cause of its end.
    """
    found, point, direction = list[Point](), begin, np.array([0.0, np.sign(longest)])
    low, high = task.ranges[1]
    if second_of(begin.linear, task.leaf) == (high if longest > 0 else low):
        return found, End.RANGE
    length, longest = _FIRST * abs(longest), abs(longest)
    while len(found) < count:
        slopes = _slopes(task, point)
        if slopes is None or not slopes.any():
            return found, End.LOST
        along = np.array([-slopes[1], slopes[0]]) / np.hypot(*slopes)
        along = along * np.copysign(1.0, along @ direction)
        step = _longest_step(task, point, along, slopes, length, _LEAST * longest)
        if isinstance(step, End):
            return found, step
        found.append(step.point)
        point, direction, length = step.point, along, step.length
        if second_of(point.linear, task.leaf) in task.ranges[1]:
            return found, End.RANGE
        if step.bend < _STRAIGHT:
            length = min(_GROW * length, longest)
    return found, End.POINTS


def _slopes(task: Task, point: Point) -> Coordinates | None:
    """Derivatives of F by s, and by the second parameter in units of its range, at a point of the
    curve, by differences.
    """
    now, found = second_of(point.linear, task.leaf), []
    for s, change in ((_NEAR, 0.0), (0.0, _NEAR * task.unit)):
        before = _at(task, point, -s, now - change)
        after = _at(task, point, s, now + change)
        if before is None or after is None:
            return None
        found.append((task.value(after) - task.value(before)) / (2 * _NEAR))
    return np.array(found)


class _Step(NamedTuple):
    """A step along the curve, its length, and how far it went across, relative to that."""

    point: Point
    length: float
    bend: float


def _longest_step(
    task: Task, point: Point, along: Coordinates, slopes: Coordinates, length: float, least: float
) -> _Step | End:
    """The first of shorter and shorter steps that leads to a motion, or the cause why there is
    none.
    """
    end = End.LOST
    while length > least:
        step = _stepped(task, point, along, slopes, length)
        cause = End.LOST if step is None else task.end_at(step.point)
        if step is not None and cause is None:
            return step
        end, length = cause or end, _SHRINK * length
    return end


def _stepped(
    task: Task, point: Point, along: Coordinates, slopes: Coordinates, length: float
) -> _Step | None:
    """The point of the curve a length ahead, or at the end of the range of the second parameter;
    `None` if it is not found nearby.
    """
    (low, high), now = task.ranges[1], second_of(point.linear, task.leaf)
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
            return _Step(found, length, abs(x) / length)
        if slope == 0 or not abs(x - value / slope) <= _BENT * length:
            return None
        old, x, known = x, x - value / slope, value
    return None
