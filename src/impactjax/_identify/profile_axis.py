"""Axis along which a parameter or another quantity is held."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._fit.profile_walk import Walk
from impactjax._fit.straight import raised, slope_of
from impactjax._fit.walks import Local
from impactjax._optimise.coordinates import slope, to_coordinate
from impactjax._parameter import Range

_BEYOND = 1.25  # distance to which a curve goes, relative to that of the end of the interval
_OPEN = 4.0  # the same on an open side, in standard errors

Places = Float[np.ndarray, " points"]


class Axis(NamedTuple):
    """Distances x from the estimate in standard errors, or in differences of the logarithm.

    - `centre`, `unit`: estimate and standard error.
    - `logarithmic`: true if x is a difference of the natural logarithm.
    - `allowed`: range of the quantity.
    - `straight`: range of what is held, the power of the quantity in which residuals are nearly
      linear; centre and unit are those of the power, too.
    """

    centre: float
    unit: float
    logarithmic: bool
    allowed: Range
    straight: Range

    def held(self, x: Places) -> Places:
        """The power of the quantity at some distances."""
        if self.logarithmic:
            return self.centre * np.exp(x)
        return self.centre + self.unit * x

    def distance(self, held: float) -> float:
        """The distance of a power of the quantity."""
        if self.logarithmic:
            return math.log(held / self.centre) if held > 0 else -math.inf
        return (held - self.centre) / self.unit

    def value(self, x: Places) -> Places:
        """The quantity itself at some distances."""
        return raised(self.held(x), 1 / self.allowed.power)

    def coordinate(self, x: Places) -> Places:
        """The coordinate of a search at some distances."""
        return to_coordinate(self.allowed, self.value(x))

    def rate(self, x: Places) -> Places:
        """The derivative of the coordinate of a search by the distance."""
        change = self.held(x) if self.logarithmic else np.full_like(x, self.unit)
        change = change * slope_of(self.value(x), self.allowed.power)
        return change / slope(self.allowed, self.coordinate(x))


def axis_of(around: Local, parameter: int) -> Axis:
    """The axis of a parameter around an estimate."""
    centre, both = float(around.values[parameter]), around.coordinates
    own, straight = both.own[parameter], both.ranges[parameter]
    return Axis(centre, around.error(parameter), around.is_scale(parameter), own, straight)


def reach(walk: Walk) -> float:
    """The distance on its side to which a curve goes after a walk: beyond the end of the interval,
    as far as the range goes and simulations work.
    """
    wanted = _BEYOND * _crossing(walk) if walk.bounded else _OPEN
    return walk.side * max(min(wanted, walk.farthest, walk.barrier), 0.0)


def _crossing(walk: Walk) -> float:
    """The distance at which the rise reaches its limit, between the last two refits."""
    assert walk.outer is not None
    (a, low), (b, high) = walk.inner, walk.outer
    return a + (walk.limit - low) / (high - low) * (b - a)
