"""Coordinates in which the residuals are nearly linear: the inverse of a parameter that fades, such
as the cutoff of a low-pass, and any other parameter itself.
"""

import math
from typing import NamedTuple

from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._optimise.coordinates import FARTHEST
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import AbstractProblem

_ROUNDING = 1e-12  # relative difference from an end that counts as none

Values = Float[AnyArray, "... parameters"]


class Straight(NamedTuple):
    """The coordinates of a problem's parameters.

    - `fades`: mask of the parameters of which the coordinate is the inverse.
    - `ranges`: ranges of the coordinates.
    - `own`: ranges of the values.
    """

    fades: tuple[bool, ...]
    ranges: tuple[Range, ...]
    own: tuple[Range, ...]

    def turned(self, values: Values) -> Values:
        """Coordinates of values, or values of coordinates."""
        xp = namespace(values)
        fades = xp.asarray(self.fades)
        zero = fades & (values == 0)
        inverse = 1 / xp.where(fades & ~zero, values, 1.0)
        return xp.where(fades, xp.where(zero, xp.inf, inverse), values)

    def slopes(self, values: Values) -> Values:
        """Derivatives of the values by their coordinates."""
        xp = namespace(values)
        return xp.where(xp.asarray(self.fades), -(values**2), 1.0)

    def interval(self, low: Values, high: Values) -> tuple[Values, Values]:
        """Ends of the values between ends of their coordinates; those of a coordinate that are
        beyond its range, or equal to an end of it but for rounding, are ends of the range.
        """
        xp = namespace(low, high)
        fades, ends = xp.asarray(self.fades), zip(self.ranges, self.own, strict=True)
        rows = [(x.low, x.high, own.low, own.high) for x, own in ends]
        least, most, lowest, highest = xp.asarray(rows, low.dtype).T
        open_low, open_high = low <= least * (1 + _ROUNDING), high >= most * (1 - _ROUNDING)
        from_high = xp.where(open_high, lowest, self.turned(xp.where(fades, high, 1.0)))
        from_low = xp.where(open_low, highest, self.turned(xp.where(fades, low, 1.0)))
        return xp.where(fades, from_high, low), xp.where(fades, from_low, high)


def straight(problem: AbstractProblem) -> Straight:
    """The coordinates of a problem's parameters."""
    own = [handle.allowed for handle in problem.handles().values()]
    fades = tuple(allowed.fades for allowed in own)
    return Straight(fades, tuple(_inverse(x) if x.fades else x for x in own), tuple(own))


def _inverse(allowed: Range) -> Range:
    """The range of the inverse."""
    high = 1 / allowed.low if allowed.low > 0 else math.inf
    low = 1 / min(allowed.high, FARTHEST)
    return allowed._replace(low=low, high=high, excludes_low=False)
