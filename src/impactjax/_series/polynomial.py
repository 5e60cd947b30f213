"""Polynomials Σ aₖ wᵏ, whose coefficients come in order of k."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jax import lax
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float, PyTree

from impactjax._types import Each, Scalar

Coefficients = Float[Array, " coefficients"]


@jax.custom_jvp
def polynomial(coefficients: Coefficients, w: Scalar, delay: Scalar) -> Scalar:
    """The value at w − delay, where the delay is zero and only its derivatives count.

    With ṗ = Σ (ȧₖ − (k + 1) aₖ₊₁ · delay′) (w − delay)ᵏ + p′ ẇ, derivatives by the delay cost
    nothing for each w.
    """
    del delay
    return horner(list(coefficients), w)


def _polynomial_jvp(
    primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]
) -> tuple[Scalar, Scalar]:
    coefficients, w, delay = primals
    d_coefficients, d_w, d_delay = tangents
    change = jnp.zeros_like(coefficients)
    if not isinstance(d_coefficients, SymbolicZero):
        change = d_coefficients
    if not isinstance(d_delay, SymbolicZero):
        change = change - jnp.append(slope(coefficients), jnp.zeros_like(delay)) * d_delay
    d_value = horner(list(change), w - delay)
    if not isinstance(d_w, SymbolicZero):
        d_value = d_value + polynomial(slope(coefficients), w, delay) * d_w
    return polynomial(coefficients, w, delay), d_value


polynomial.defjvp(_polynomial_jvp, symbolic_zeros=True)


def slope(coefficients: Coefficients) -> Float[Array, " slopes"]:
    """The coefficients of the derivative."""
    powers = jnp.arange(1, coefficients.shape[0], dtype=coefficients.dtype)
    return powers * coefficients[1:]


def rescaled(coefficients: Sequence[Each], factor: Scalar) -> list[Each]:
    """The coefficients of p(factor w)."""
    power, scaled = jnp.ones_like(factor), []
    for coefficient in coefficients:
        scaled.append(coefficient * power)
        power = power * factor
    return scaled


def horner(coefficients: Sequence[Array], w: Scalar) -> Array:
    """The value at w, by Horner's rule."""
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * w + coefficient
    return value


def horner_with_slope(coefficients: Sequence[Each], w: Each) -> tuple[Each, Each]:
    """Value and derivative at w, by Horner's rule."""
    value, slope = coefficients[-1], jnp.zeros_like(w)
    for coefficient in coefficients[-2::-1]:
        slope = lax.add(lax.mul(slope, w), value)
        value = lax.add(lax.mul(value, w), coefficient)
    return value, slope
