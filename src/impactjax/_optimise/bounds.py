"""Transformations between a parameter in its range and an unbounded coordinate.

For optimisers and samplers that know no limits. No step of u can leave the range:

- no limit: value = u
- above `low`: value = low + exp(u)
- from `low`: value = low + 2 sinh²(u/2); likewise downwards from `high`
- from `low` to `high`: value = low + (high − low) (1 + sin u) / 2
"""

import math

from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._parameter import Range

Values = Float[AnyArray, "..."]


def to_unbounded(allowed: Range, value: Values) -> Values:
    """The unbounded coordinate of a value in range."""
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
    """The value in range at an unbounded coordinate."""
    xp, low, high = namespace(u), allowed.low, allowed.high
    if low == -math.inf and high == math.inf:
        return u
    if high == math.inf and allowed.excludes_low:
        return low + xp.exp(u)
    if high == math.inf or low == -math.inf:
        beyond = 2 * xp.sinh(u / 2) ** 2
        return low + beyond if high == math.inf else high - beyond
    return low + (high - low) / 2 * (xp.sin(u) + 1)
