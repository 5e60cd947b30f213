"""Coordinates in which the residuals are nearly linear: powers of parameters, such as the inverse
of the cutoff of a low-pass, and k^(−0.4) of the stiffness of a contact, to which its duration is
proportional.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._optimise.coordinates import FARTHEST
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import AbstractProblem

_ROUNDING = 1e-12  # relative difference from an end that counts as none

Values = Float[AnyArray, "... parameters"]
Numbers = Float[AnyArray, "..."]


class Straight(NamedTuple):
    """The coordinates of a problem's parameters.

    - `powers`: the power of each parameter that is its coordinate.
    - `fades`: mask of the parameters whose effect vanishes at infinity.
    - `ranges`: ranges of the coordinates.
    - `own`: ranges of the values.
    """

    powers: tuple[float, ...]
    fades: tuple[bool, ...]
    ranges: tuple[Range, ...]
    own: tuple[Range, ...]

    def places(self, values: Values) -> Values:
        """Coordinates of values."""
        return raised(values, namespace(values).asarray(self.powers, values.dtype))

    def values(self, places: Values) -> Values:
        """Values of coordinates."""
        return raised(places, 1 / namespace(places).asarray(self.powers, places.dtype))

    def slopes(self, values: Values) -> Values:
        """Derivatives of the values by their coordinates."""
        return slope_of(values, namespace(values).asarray(self.powers, values.dtype))

    def span(self, low: Values, high: Values) -> tuple[Values, Values]:
        """Ends of the coordinates between ends of their values."""
        xp = namespace(low, high)
        ends = xp.stack([self.places(low), self.places(high)])
        return ends.min(axis=0), ends.max(axis=0)

    def interval(self, low: Values, high: Values) -> tuple[Values, Values]:
        """Ends of the values between ends of their coordinates; those of a power that are beyond
        its range, or equal to an end of it but for rounding, are ends of the range.
        """
        xp = namespace(low, high)
        powers, ends = xp.asarray(self.powers, low.dtype), zip(self.ranges, self.own, strict=True)
        rows = [(x.low, x.high, own.low, own.high) for x, own in ends]
        least, most, lowest, highest = xp.asarray(rows, low.dtype).T
        falls, bent = powers < 0, powers != 1
        open_low, open_high = low <= least * (1 + _ROUNDING), high >= most * (1 - _ROUNDING)
        from_low = xp.where(bent & open_low, xp.where(falls, highest, lowest), self.values(low))
        from_high = xp.where(bent & open_high, xp.where(falls, lowest, highest), self.values(high))
        return xp.where(falls, from_high, from_low), xp.where(falls, from_low, from_high)


def straight(problem: AbstractProblem) -> Straight:
    """The coordinates of a problem's parameters."""
    own = tuple(handle.allowed for handle in problem.handles().values())
    powers, fades = (each.power for each in own), (each.fades for each in own)
    return Straight(tuple(powers), tuple(fades), tuple(map(_of_power, own)), own)


@np.errstate(over="ignore")  # infinite, as in JAX
def raised(values: Numbers, powers: Numbers | float) -> Numbers:
    """Powers of numbers that are not negative; those to the power of one are unchanged."""
    xp = namespace(values)
    powers = xp.asarray(powers, values.dtype)
    positive = values > 0
    power = xp.where(positive, values, 1.0) ** powers
    at_zero = xp.where(powers < 0, xp.inf, 0.0)
    return xp.where(powers == 1, values, xp.where(positive, power, at_zero))


def slope_of(values: Numbers, powers: Numbers | float) -> Numbers:
    """Derivatives of numbers by their powers."""
    xp = namespace(values)
    powers = xp.asarray(powers, values.dtype)
    return xp.where(powers == 1, 1.0, raised(values, 1 - powers) / powers)


def _of_power(allowed: Range) -> Range:
    """The range of the power of a parameter. One that fades ends at a finite value."""
    if allowed.power == 1:
        return allowed
    most = min(allowed.high, FARTHEST) if allowed.fades else allowed.high
    low, high = _power(allowed.low, allowed.power), _power(most, allowed.power)
    if allowed.power > 0:
        return allowed._replace(low=low, high=high)
    return allowed._replace(low=high, high=low, excludes_low=most == math.inf)


def _power(value: float, power: float) -> float:
    """The power of a number that is not negative; infinite for a negative one of zero."""
    return math.inf if value == 0 and power < 0 else value**power
