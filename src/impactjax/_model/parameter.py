"""How a number becomes a parameter of a model, and what is asked of it."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float


def as_parameter(value: ArrayLike) -> Float[Array, "..."]:
    """A number as a floating-point array, so that its value never causes a retrace."""
    array = jnp.asarray(value)
    if not jnp.issubdtype(array.dtype, jnp.inexact):
        array = array.astype(jnp.result_type(float))
    return array


def as_optional_parameter(value: ArrayLike | None) -> Float[Array, "..."] | None:
    """As `as_parameter`; `None` leaves that part of the physics out."""
    return None if value is None else as_parameter(value)


class Requirement(NamedTuple):
    """A condition on parameters and the sentence to say when it does not hold."""

    holds: Bool[Array, "..."]
    sentence: str


def finite(name: str, value: Float[Array, "..."]) -> Requirement:
    """`value` is a finite number."""
    return Requirement(jnp.isfinite(value), f"`{name}` must be finite")


def positive(name: str, value: Float[Array, "..."]) -> Requirement:
    """`value` is finite and greater than zero."""
    return Requirement(jnp.isfinite(value) & (value > 0), f"`{name}` must be positive and finite")


def not_negative(name: str, value: Float[Array, "..."]) -> Requirement:
    """`value` is finite and at least zero."""
    return Requirement(
        jnp.isfinite(value) & (value >= 0), f"`{name}` must be finite and not negative"
    )


def within(name: str, value: Float[Array, "..."], low: float, high: float) -> Requirement:
    """`value` lies in the closed interval from `low` to `high`."""
    return Requirement((value >= low) & (value <= high), f"`{name}` must be from {low} to {high}")


def raise_if_violated(owner: eqx.Module, requirements: tuple[Requirement, ...]) -> None:
    """Raises `ValueError` for the first requirement that is known not to hold.

    Traced values are let through: under `jit` they become a result code of the lane.
    """
    for holds, sentence in requirements:
        if not isinstance(holds, Tracer) and not np.all(holds):
            raise ValueError(f"{type(owner).__name__}: {sentence}.")
