"""Roots with exact derivatives."""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PyTree

_ITERATIONS = 12  # more than any use needs: Newton's method converges from one side


def root(
    residual: Callable[..., Float[Array, "..."]], start: Float[Array, "..."], parameters: PyTree
) -> Float[Array, "..."]:
    """The root x of residual(x, parameters), elementwise, by Newton's method from `start`, with
    derivatives as in `implicit`.
    """
    still = jax.lax.stop_gradient(parameters)

    def improve(_: Int[Array, ""], x: Float[Array, "..."]) -> Float[Array, "..."]:
        value, slope = jax.jvp(lambda x: residual(x, still), (x,), (jnp.ones_like(x),))
        return x - value / slope

    found = jax.lax.fori_loop(0, _ITERATIONS, improve, jax.lax.stop_gradient(start))
    return implicit(residual, found, parameters)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def implicit(
    residual: Callable[..., Float[Array, "..."]], found: Float[Array, "..."], parameters: PyTree
) -> Float[Array, "..."]:
    """A root x of residual(x, parameters), elementwise, that was `found` as a plain number.

    Derivatives of any order follow from the implicit function theorem.
    """
    del residual, parameters
    return found


@implicit.defjvp
def _(residual: Callable, primals: tuple, tangents: tuple) -> tuple:
    found, parameters = primals
    x = implicit(residual, found, parameters)
    _, slope = jax.jvp(lambda x: residual(x, parameters), (x,), (jnp.ones_like(x),))
    _, change = jax.jvp(lambda p: residual(x, p), (parameters,), (tangents[1],))
    return x, -change / slope
