"""Parameters in their range as unbounded numbers, for the optimiser."""

import math

import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._model.parameter import Range

Values = Float[Array, "..."]


def to_unbounded(allowed: Range, value: Values) -> Values:
    """The unbounded number that stands for a value in range."""
    low, high = allowed.low, allowed.high
    if low == -math.inf and high == math.inf:
        return value
    if high == math.inf and allowed.excludes_low:
        return jnp.log(value - low)
    if high == math.inf or low == -math.inf:
        beyond = value - low if high == math.inf else high - value
        return 2 * jnp.arcsinh(jnp.sqrt(jnp.maximum(beyond, 0) / 2))
    return jnp.arcsin(jnp.clip(2 * (value - low) / (high - low) - 1, -1, 1))


def to_range(allowed: Range, u: Values) -> Values:
    """The value in range that an unbounded number stands for."""
    low, high = allowed.low, allowed.high
    if low == -math.inf and high == math.inf:
        return u
    if high == math.inf and allowed.excludes_low:
        return low + jnp.exp(u)
    if high == math.inf or low == -math.inf:
        beyond = 2 * jnp.sinh(u / 2) ** 2
        return low + beyond if high == math.inf else high - beyond
    return low + (high - low) / 2 * (jnp.sin(u) + 1)


def farthest_move(allowed: Range) -> float:
    """How far the unbounded number may move at once, so as not to get lost far out."""
    return math.inf if allowed.low == -math.inf and allowed.high == math.inf else 1.0
