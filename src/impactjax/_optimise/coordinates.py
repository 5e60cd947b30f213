"""Coordinates in which a search moves a parameter, bounded like its range.

- a parameter whose effect fades towards infinity: u = 1 / value
- no limit, or limits on both sides: u = value
- above `low`: u = log(value − low), without limit
- from `low`: u = arcsinh(value − low) ≥ 0; likewise downwards from `high`

Where a range has one end, a step of 1 changes a large value by a factor of e. Derivatives do not
vanish at the end of a range.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._parameter import Range

_SHARE = 0.5  # of a range with two ends, the longest step
FARTHEST = 1e12  # value that counts as infinity
_INSIDE = 1e-9  # share of it kept from an end that is not allowed

Coordinate = Float[AnyArray, "..."]
Value = Float[AnyArray, "..."]


class Limits(NamedTuple):
    """Limits of a coordinate, and of its change in one step."""

    low: float
    high: float
    step: float


@np.errstate(all="ignore")  # no warnings, as in JAX
def to_coordinate(allowed: Range, value: Value) -> Coordinate:
    """The coordinate of a value in range; −∞ at an end that is not allowed."""
    xp, low, high = namespace(value), allowed.low, allowed.high
    if allowed.fades:
        return 1 / value
    if math.isfinite(low) == math.isfinite(high):
        return value
    if allowed.excludes_low:
        return xp.log(value - low)
    return xp.arcsinh(value - low) if high == math.inf else -xp.arcsinh(high - value)


def to_value(allowed: Range, u: Coordinate) -> Value:
    """The value at a coordinate."""
    xp, low, high = namespace(u), allowed.low, allowed.high
    if allowed.fades:
        return xp.clip(1 / u, low, high)  # rounding could leave the range
    if math.isfinite(low) == math.isfinite(high):
        return u
    if allowed.excludes_low:
        return low + xp.exp(u)
    return low + xp.sinh(u) if high == math.inf else high + xp.sinh(u)


def slope(allowed: Range, u: Coordinate) -> Coordinate:
    """The derivative of the value by its coordinate."""
    xp = namespace(u)
    if allowed.fades:
        return -1 / u**2
    if math.isfinite(allowed.low) == math.isfinite(allowed.high):
        return xp.ones_like(u)
    return xp.exp(u) if allowed.excludes_low else xp.cosh(u)


def limits(allowed: Range) -> Limits:
    """The limits of a coordinate, and of its change in one step."""
    low, high = allowed.low, allowed.high
    if allowed.fades:
        slowest = 1 / low if low > 0 else math.inf
        return Limits(1 / min(high, FARTHEST), slowest, math.inf)
    if math.isfinite(low) and math.isfinite(high):
        inside = _INSIDE * (high - low) if allowed.excludes_low else 0.0
        return Limits(low + inside, high, _SHARE * (high - low))
    if math.isfinite(high):
        return Limits(-math.inf, 0.0, 1.0)
    if math.isfinite(low):
        return Limits(-math.inf if allowed.excludes_low else 0.0, math.inf, 1.0)
    return Limits(-math.inf, math.inf, math.inf)
