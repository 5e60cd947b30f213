"""The family of force laws F = k δⁿ + c δᵖ |δ′|^q sgn δ′, as one function."""

from typing import TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._types import Force, Length, Speed

Coefficient: TypeAlias = Float[Array, "..."]  # its unit follows from the exponents
Exponent: TypeAlias = Float[Array, "..."] | float | int

HERTZIAN = -0.4
"""Power of the stiffness to which the duration of a contact with F = k δ^1.5 is proportional."""


def power_force(
    penetration: Length,
    rate: Speed,
    k: Coefficient,
    c: Coefficient,
    n: Exponent,
    p: Exponent,
    q: Exponent,
) -> Force:
    """F = k δⁿ + c δᵖ |δ′|^q sgn δ′; analytic if the exponents are plain integers."""
    return k * power(penetration, n) + c * power(penetration, p) * odd_power(rate, q)


def power(x: Float[Array, "..."], exponent: Exponent) -> Float[Array, "..."]:
    """xⁿ for x > 0 and zero elsewhere; for n = 0 one everywhere. If n is a Python integer, the
    polynomial xⁿ for all x. The first derivative at x = 0 is that from the right, or zero if that
    is infinite; higher ones are zero.
    """
    if isinstance(exponent, int):
        return x**exponent
    # Contact begins at x = 0, where some derivative of xⁿ is infinite. Even in a branch that is not
    # taken it would turn gradients into NaN, so x is replaced. The replacement is small, because
    # XLA may round x differently in two kernels, so that they disagree on the branch.
    inside = x > 0
    safe = jnp.where(inside, x, jnp.finfo(x.dtype).tiny ** 0.2)
    outside = jnp.where(exponent == 0, 1, _at_zero(x, exponent))
    return jnp.where(inside, safe**exponent, outside)


def odd_power(x: Float[Array, "..."], exponent: Exponent) -> Float[Array, "..."]:
    """Odd power |x|^q sgn x."""
    if isinstance(exponent, int) and exponent % 2 == 1:
        return x**exponent
    away = jnp.sign(x) * power(jnp.abs(x), exponent)
    return jnp.where(x == 0, _at_zero(x, exponent), away)


def _at_zero(x: Float[Array, "..."], exponent: Exponent) -> Float[Array, "..."]:
    """Zero, with the derivative of xⁿ at x = 0: one for n = 1."""
    return jnp.where((x == 0) & (exponent == 1), x, jnp.zeros_like(x))
