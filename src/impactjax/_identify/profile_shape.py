"""The shape of a profile, and the interval that it bounds."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._abstract_code import AbstractCode

_LOWER = 1.0  # fall of the rise below zero from which the estimate is not the minimum
_DEPTH = 0.2  # depth of another minimum that counts, and its share of the rise there

Values = Float[np.ndarray, " points"]


class ProfileShape(AbstractCode):
    """Shape of a profile: where it crosses the threshold of the 95 % interval."""

    BOUNDED = 0, "bounded"  # on both sides
    OPEN_BELOW = 1, "open below"  # only above the estimate
    OPEN_ABOVE = 2, "open above"  # only below the estimate
    FLAT = 3, "flat"  # on neither side
    SEVERAL_MINIMA = 4, "several minima"  # of which another one matters, or is the lowest
    UNDECIDED = 5, "undecided"  # no interval that can be relied on


class Crossings(NamedTuple):
    """Places where a profile crosses its threshold on both sides: −∞ and ∞ where it does not; NaN
    where a side is unknown.
    """

    low: float
    high: float


def crossings(x: Values, rise: Values, threshold: float, known: tuple[bool, bool]) -> Crossings:
    """The outermost crossings, linear in √rise between points.

    **Arguments:**

    - `x`, `rise`: distances and rise of the points; NaN where a fit failed.
    - `known`: for each end of the curve, true if the profile is open there unless it crosses.
    """
    root, limit = np.sqrt(np.maximum(rise, 0)), np.sqrt(threshold)
    low = _outermost(x[::-1], root[::-1], limit, -np.inf if known[0] else np.nan)
    return Crossings(low, _outermost(x, root, limit, np.inf if known[1] else np.nan))


def _outermost(x: Values, root: Values, limit: float, beyond: float) -> float:
    """The last crossing from below in the order of the points."""
    inside = np.flatnonzero(root <= limit)
    if not len(inside):
        return np.nan
    last = int(inside[-1])
    if last == len(x) - 1:
        return beyond
    share = (limit - root[last]) / (root[last + 1] - root[last])  # NaN if the next one failed
    return float(x[last] + share * (x[last + 1] - x[last]))


def has_several_minima(rise: Values) -> bool:
    """True if the profile has a second minimum, or one that is lower than the estimate."""
    heights = rise[np.isfinite(rise)]
    if not len(heights) or heights.min() < -_LOWER:
        return bool(len(heights))
    lowest = int(heights.argmin())
    for side in (heights[lowest:], heights[lowest::-1]):
        barrier = np.maximum.accumulate(side)
        if (barrier - side > _DEPTH * (1 + np.maximum(side, 0))).any():
            return True
    return False


def shape_of(rise: Values, ends: Crossings, *, doubtful: bool) -> ProfileShape:
    """The shape of a profile.

    **Arguments:**

    - `doubtful`: as in `Estimate`: no interval can be relied on.
    """
    if has_several_minima(rise):
        return ProfileShape.SEVERAL_MINIMA
    below, above = np.isfinite(ends.low), np.isfinite(ends.high)
    if np.isnan(ends.low) or np.isnan(ends.high) or (below and above and doubtful):
        return ProfileShape.UNDECIDED
    if below and above:
        return ProfileShape.BOUNDED
    if below or above:
        return ProfileShape.OPEN_ABOVE if below else ProfileShape.OPEN_BELOW
    return ProfileShape.FLAT
