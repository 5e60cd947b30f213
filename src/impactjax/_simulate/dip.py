"""Closest approach to zero of a function of one sign, from values and slopes at some nodes."""

import jax.numpy as jnp
from jaxtyping import Array, Float

Values = Float[Array, "... nodes"]


def closest_to_zero(values: Values, slopes: Values) -> Float[Array, "..."]:
    """Place of the closest approach to zero, as a share of the whole interval, by the cubic Hermite
    polynomial between each pair of equidistant nodes; the middle of the first part if there is
    none.

    Slopes are derivatives by the share of a part.
    """
    a, b = values[..., :-1], values[..., 1:]
    m, n = slopes[..., :-1], slopes[..., 1:]
    square, cube = 3 * (b - a) - 2 * m - n, m + n - 2 * (b - a)
    root = jnp.sqrt(jnp.maximum(square**2 - 3 * cube * m, 0))
    sum_ = -(square + jnp.where(square < 0, -root, root))
    places = [_divided(sum_, 3 * cube), _divided(m, sum_)]
    best, least = jnp.full_like(a, 0.5), jnp.full_like(a, jnp.inf)
    for x in places:
        value = jnp.sign(a) * (a + x * (m + x * (square + x * cube)))
        inside = (x > 0) & (x < 1) & (a * b > 0)
        value = jnp.where(inside, value, jnp.inf)
        nearer = value < jnp.minimum(least, jnp.minimum(jnp.abs(a), jnp.abs(b)))
        best, least = jnp.where(nearer, x, best), jnp.where(nearer, value, least)
    part = jnp.argmin(least, axis=-1)
    place = jnp.take_along_axis(best, part[..., None], axis=-1)[..., 0]
    return (part.astype(place.dtype) + place) / a.shape[-1]


def _divided(x: Values, y: Values) -> Values:
    """Quotient x / y; a place outside the part if that is not finite."""
    return jnp.where(y != 0, x / jnp.where(y != 0, y, 1.0), -1.0)
