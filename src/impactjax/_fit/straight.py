"""Coordinates in which the residuals are nearly linear: the inverse of a parameter that fades, such
as the cutoff of a low-pass, and any other parameter itself.
"""

import math
from typing import NamedTuple

from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import AbstractProblem

Values = Float[AnyArray, "... parameters"]


class Straight(NamedTuple):
    """The coordinates of a problem's parameters.

    - `fades`: mask of the parameters of which the coordinate is the inverse.
    - `ranges`: ranges of the coordinates.
    """

    fades: tuple[bool, ...]
    ranges: tuple[Range, ...]

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


def straight(problem: AbstractProblem) -> Straight:
    """The coordinates of a problem's parameters."""
    own = [handle.allowed for handle in problem.handles().values()]
    fades = tuple(allowed.fades for allowed in own)
    return Straight(fades, tuple(_inverse(each) if each.fades else each for each in own))


def _inverse(allowed: Range) -> Range:
    """The range of the inverse."""
    high = 1 / allowed.low if allowed.low > 0 else math.inf
    return allowed._replace(low=1 / allowed.high, high=high, excludes_low=False)
