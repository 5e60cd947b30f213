"""The verb `special_curve`: special point of a branch → curve of such points in two parameters.

At a value of the second parameter the branch of orbits is followed in the first one, and the kind
of a point is a function F that vanishes there (see `special.py`). In the plane of the place s along
that branch and the second parameter, the curve is F = 0. Since s, and not the first parameter, is a
coordinate, curves of folds go smoothly through their cusps.

Source: W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, for
test functions and their curves.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from impactjax._refusal import check_kind, check_number, whole
from impactjax._response.branch import SpecialPoint
from impactjax._response.curve_walk import End, Task, second_of, walked
from impactjax._response.linear import Linear, Vector
from impactjax._response.newton import sizes_of
from impactjax._response.orbit import Orbit, orbit_of
from impactjax._response.parameter import Where, place_of, range_of
from impactjax._response.point import first_point
from impactjax._response.special import Kind, is_repeated, values_at

_ZERO = 1e-9  # up to this, a function counts as zero; of several, the first one is smooth
_INCOMPLETE = (End.POINTS.value, End.LOST.value)


class SpecialCurve(eqx.Module):
    """Curve of special points of one kind in two parameters, in order along it.

    - `kind`: as of a `SpecialPoint`.
    - `first`, `second`: values of the parameters: that of the branch, and the other one.
    - `period`: period of each orbit.
    - `multipliers`: Floquet multipliers, the largest first.
    - `ends`: cause of the first and of the last end: end of the range, or of the first range, a
      grazing, an onset of sticking or another itinerary (orbits beyond are no motions), largest
      number of points, or lost by Newton's method.
    """

    kind: str
    first: Float[np.ndarray, " points"]
    second: Float[np.ndarray, " points"]
    period: Float[np.ndarray, " points"]
    multipliers: Complex[np.ndarray, "points numbers"]
    ends: tuple[str, str]
    linears: tuple[Linear, ...]
    sizes: Vector

    @property
    def complete(self) -> bool:
        """True if neither end is for want of points or of Newton's method."""
        return not {*self.ends} & {*_INCOMPLETE}

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
    if kind in (Kind.RANGE, Kind.STICKING, Kind.OTHER_EVENTS):
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
        range_of("between", between, second_of(linear, leaf)),
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
    task = Task(kind, number, leaf, ranges, sizes)
    (down, first), (up, last) = (walked(task, begin, sign * longest, count) for sign in (-1.0, 1.0))
    linears = tuple(point.linear for point in [*down[::-1], begin, *up])
    second = np.array([second_of(each, leaf) for each in linears])
    return SpecialCurve(
        kind.value,
        np.array([each.unknowns[-1] for each in linears]),
        second,
        np.array([each.period for each in linears]),
        np.stack([each.multipliers() for each in linears]),
        (first.value, last.value),
        linears,
        sizes,
    )


def _leaf(linear: Linear, where: Where) -> int:
    """The index of the second parameter. Raises `ValueError` if it is that of the branch."""
    family = linear.cycle.family
    leaf = place_of(family.at(jnp.asarray(linear.unknowns[-1])), where)
    if np.any(np.asarray(jax.tree.leaves(family.along, is_leaf=_is_none)[leaf])):
        raise ValueError("Argument `where` selects the parameter of the branch: choose another.")
    return leaf


def _is_none(leaf: object) -> bool:
    return leaf is None
