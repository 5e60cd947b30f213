"""The verb `follow`: orbit and parameter → branch."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from impactjax._refusal import check_kind, check_number, whole
from impactjax._response.branch import Branch, Visited, branch_of
from impactjax._response.linear import Linear, Vector, linearised
from impactjax._response.locate import LostError, specials_between
from impactjax._response.newton import sizes_of
from impactjax._response.orbit import Orbit
from impactjax._response.parameter import Where, place_of, range_of
from impactjax._response.point import Point, corrected, first_point
from impactjax._results import RESULTS

_LEAST = 1e-6  # step, in units of the longest one, below which the branch is lost
_FIRST = 0.1  # first step in the same units
_TURN = 0.97  # cosine of the largest angle between tangents of neighbours
_STRAIGHT = 0.995  # cosine of an angle after which the step grows
_QUICK = 3  # Newton steps after which the step grows
_GROW, _SHRINK = 1.5, 0.5


def follow(
    orbit: Orbit,
    where: Where,
    between: tuple[float, float],
    *,
    longest: float = 0.05,
    max_points: int = 500,
) -> Branch:
    """Follows a periodic orbit in a parameter, to both sides.

    Pseudo-arclength continuation: a step along the tangent of the branch, then Newton's method in
    the plane across it, so that the branch may turn back at folds. Special points between two
    points are found as zeros of functions that change sign there, to rounding. The branch ends
    where the parameter leaves its range, and where the orbit grazes, where a rest after a complete
    chatter vanishes, or its events change their order: the orbits beyond are no motions.

    **Arguments:**

    - `orbit`: result of `periodic_orbit`, or of `doubled`.
    - `where`: selects the parameter, one number of the system: `lambda system: system.amplitude`.
    - `between`: least and largest value of the parameter.
    - `longest`: longest step, in units in which the range of the parameter, the period, and the
      largest values of the state are 1.
    - `max_points`: largest number of points to each side.

    **Raises** `ValueError` for an orbit that was not found, a parameter that is not one real
    number, and a range without its value; `TypeError` for arguments of the wrong type.
    """
    check_kind("orbit", orbit, Orbit, "periodic_orbit(system, start, period)")
    if orbit.result != RESULTS.successful:
        raise ValueError(f"Argument `orbit` was not found: {RESULTS[orbit.result]}")
    linear = _along(orbit.linear, where)
    low, high = range_of("between", between, float(linear.unknowns[-1]))
    check_number("longest", longest)
    if not 0 < longest < np.inf:
        raise ValueError(f"Argument `longest` must be positive and finite, but it is {longest}.")
    sizes = sizes_of(linear, high - low)
    count = whole("max_points", max_points)
    first = first_point(linear, sizes)
    up = _walked(first, sizes, (low, high), longest, count)
    if up.closed:
        return branch_of([Visited(first), *up.visited], sizes, True)
    down = _walked(first.reversed(), sizes, (low, high), longest, count)
    visited = [*down.visited[::-1], Visited(first), *up.visited]
    return branch_of(visited, sizes, up.complete and down.complete)


def _along(linear: Linear, where: Where) -> Linear:
    """Equations of an orbit with a selected parameter of the system as their parameter."""
    old = linear.cycle.family
    system = old.at(jnp.asarray(linear.unknowns[-1]))
    leaves, structure = jax.tree.flatten(system)
    own = place_of(system, where)
    value = leaves[own]
    zeros = [jnp.zeros_like(leaf) if eqx.is_inexact_array(leaf) else None for leaf in leaves]
    along = [jnp.ones_like(value) if number == own else each for number, each in enumerate(zeros)]
    leaves[own] = jnp.zeros_like(value)
    family = eqx.tree_at(
        lambda each: (each.system, each.along),
        old,
        (jax.tree.unflatten(structure, leaves), jax.tree.unflatten(structure, along)),
    )
    cycle = linear.cycle._replace(family=family)
    return linearised(cycle, np.append(linear.unknowns[:-1], float(value)))


class _Side(NamedTuple):
    """One side of a branch; `complete` if it ends at a special point, or at the first one again."""

    visited: list[Visited]
    complete: bool
    closed: bool


def _walked(
    first: Point, sizes: Vector, between: tuple[float, float], longest: float, count: int
) -> _Side:
    visited: list[Visited] = []
    point, length = first, _FIRST * longest
    while len(visited) < count and length > _LEAST * longest:
        ahead = corrected(point, point.place + length * point.tangent, sizes, length)
        cosine = -1.0 if ahead is None else float(ahead.tangent @ point.tangent)
        if ahead is None or cosine < _TURN:
            length *= _SHRINK
            continue
        try:
            found = specials_between(point, ahead, sizes, between)
        except LostError:
            length *= _SHRINK
            continue
        visited += [Visited(each.point, each) for each in found]
        if found and found[-1].ends:
            return _Side(visited, True, False)
        visited.append(Visited(ahead))
        if _returns(first, point, ahead):
            return _Side(visited, True, True)
        point = ahead
        if cosine > _STRAIGHT and ahead.steps <= _QUICK:
            length = min(_GROW * length, longest)
    return _Side(visited, False, False)


def _returns(first: Point, point: Point, ahead: Point) -> bool:
    """True if the step from `point` to `ahead` goes past the first point of the branch."""
    step = float(np.linalg.norm(ahead.place - point.place))
    before, after = (float(first.tangent @ (each.place - first.place)) for each in (point, ahead))
    near = float(np.linalg.norm(ahead.place - first.place)) <= step
    return before < 0 <= after and near
