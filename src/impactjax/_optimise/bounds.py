"""Parameters in their range as unbounded numbers, for the optimiser."""

import math

from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._parameter import Range

Values = Float[AnyArray, "..."]


def to_unbounded(allowed: Range, value: Values) -> Values:
    """The unbounded number that stands for a value in range."""
    xp, low, high = namespace(value), allowed.low, allowed.high
    if low == -math.inf and high == math.inf:
        return value
    if high == math.inf and allowed.excludes_low:
        return xp.log(value - low)
    if high == math.inf or low == -math.inf:
        beyond = value - low if high == math.inf else high - value
        return 2 * xp.arcsinh(xp.sqrt(xp.maximum(beyond, 0) / 2))
    return xp.arcsin(xp.clip(2 * (value - low) / (high - low) - 1, -1, 1))


def to_range(allowed: Range, u: Values) -> Values:
    """The value in range that an unbounded number stands for."""
    xp, low, high = namespace(u), allowed.low, allowed.high
    if low == -math.inf and high == math.inf:
        return u
    if high == math.inf and allowed.excludes_low:
        return low + xp.exp(u)
    if high == math.inf or low == -math.inf:
        beyond = 2 * xp.sinh(u / 2) ** 2
        return low + beyond if high == math.inf else high - beyond
    return low + (high - low) / 2 * (xp.sin(u) + 1)


def slope(allowed: Range, u: Values) -> Values:
    """The derivative of the value in range by its unbounded number."""
    xp, low, high = namespace(u), allowed.low, allowed.high
    if low == -math.inf and high == math.inf:
        return xp.ones_like(u)
    if high == math.inf and allowed.excludes_low:
        return xp.exp(u)
    if high == math.inf or low == -math.inf:
        return xp.sinh(u) if high == math.inf else -xp.sinh(u)
    return (high - low) / 2 * xp.cos(u)


def farthest_move(allowed: Range) -> float:
    """How far the unbounded number may move at once, so as not to get lost far out."""
    return math.inf if allowed.low == -math.inf and allowed.high == math.inf else 1.0
