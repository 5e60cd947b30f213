"""Branches of periodic orbits in a parameter."""

from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Bool, Complex, Float

from impactjax._hybrid.system import State
from impactjax._response.linear import Linear, Vector
from impactjax._response.orbit import Orbit, events_of, orbit_of, states_of
from impactjax._response.point import Point
from impactjax._response.special import Special


class Visited(NamedTuple):
    """Point of a branch, and what is special there."""

    point: Point
    special: Special | None = None


class SpecialPoint(NamedTuple):
    """Special point of a branch.

    - `kind`: its name: fold, period doubling, Neimark-Sacker, grazing, onset of sticking (of a rest
      that follows a complete chatter), another itinerary (two events change their order, or a jump
      leads to another mode), or end of the range.
    - `place`: its number among the points of the branch.
    - `parameter`: value of the parameter.
    - `orbit`: its orbit.
    """

    kind: str
    place: int
    parameter: float
    orbit: Orbit


class Branch(eqx.Module):
    """Branch of periodic orbits in a parameter, in order along it.

    - `parameter`: value of the parameter at each point.
    - `period`: period of each orbit.
    - `t`, `before`, `after`: times of its events, and states before and after them, one column for
      each event; for orbits without events, time and state at the start.
    - `multipliers`: Floquet multipliers, the largest first.
    - `summed`: longest duration of an endless series of events that is summed; 0 without one. A
      branch keeps the number of events before the sum, so that it may become longer than in
      `solve`, and less exact.
    - `special`: special points, which are among the points, in order.
    - `complete`: true if both ends are special points or one: the branch is closed. Otherwise the
      number of points did not suffice, or Newton's method has lost the branch.
    """

    parameter: Float[np.ndarray, " points"]
    period: Float[np.ndarray, " points"]
    t: Float[np.ndarray, "points events"]
    before: State
    after: State
    multipliers: Complex[np.ndarray, "points numbers"]
    summed: Float[np.ndarray, " points"]
    special: tuple[SpecialPoint, ...]
    complete: bool
    points: tuple[Point, ...]
    sizes: Vector

    @property
    def stable(self) -> Bool[np.ndarray, " points"]:
        """True for each orbit whose multipliers all lie inside the unit circle, without that of a
        shift in time.
        """
        return np.array([each.linear.largest() for each in self.points]) < 1

    def orbit(self, index: int) -> Orbit:
        """The orbit at a point."""
        return orbit_of(self.points[index].linear, self.sizes, True)


def branch_of(visited: list[Visited], sizes: Vector, complete: bool) -> Branch:
    """The branch through some points."""
    linears = [each.point.linear for each in visited]
    events = [columns_of(linear) for linear in linears]
    t, before, after = jax.tree.map(lambda *rows: np.stack(rows), *events)
    specials = [
        SpecialPoint(
            each.special.kind.value,
            index,
            float(each.point.linear.unknowns[-1]),
            orbit_of(each.point.linear, sizes, True),
        )
        for index, each in enumerate(visited)
        if each.special is not None
    ]
    return Branch(
        np.array([linear.unknowns[-1] for linear in linears]),
        np.array([linear.period for linear in linears]),
        t,
        before,
        after,
        np.stack([linear.multipliers() for linear in linears]),
        np.array([np.max(linear.pieces.wait) for linear in linears]),
        tuple(specials),
        complete,
        tuple(each.point for each in visited),
        sizes,
    )


def columns_of(linear: Linear) -> tuple[np.ndarray, State, State]:
    """Times and states of the events of an orbit, or of its start if it has none."""
    events = events_of(linear)
    if events.t.size:
        return events.t, events.before, events.after
    arcs = linear.cycle.arcs(linear.unknowns)
    y = states_of(arcs.y, linear.cycle.family.like)
    return arcs.t, y, y
