"""Roots of equations, with exact derivatives by the implicit function theorem.

For residual(x, p) = 0 it is dx/dp = −(∂residual/∂p) / (∂residual/∂x).
"""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PyTree

_ITERATIONS = 12  # enough for all uses: Newton's method converges from one side


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
    """A root x of residual(x, parameters), elementwise, whose value is `found` without derivatives.

    Derivatives of any order follow from the implicit function theorem.
    """
    del residual, parameters
    return found


@implicit.defjvp
def _(
    residual: Callable[..., Float[Array, "..."]],
    primals: tuple[PyTree, ...],
    tangents: tuple[PyTree, ...],
) -> tuple[PyTree, ...]:
    found, parameters = primals
    x = implicit(residual, found, parameters)
    _, slope = jax.jvp(lambda x: residual(x, parameters), (x,), (jnp.ones_like(x),))
    _, change = jax.jvp(lambda p: residual(x, p), (parameters,), (tangents[1],))
    return x, -change / slope


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def at_turn(
    function: Callable[..., Float[Array, "..."]],
    slope: Callable[..., Float[Array, "..."]],
    found: Float[Array, "..."],
    parameters: PyTree,
) -> Float[Array, "..."]:
    """The value function(x, parameters) at a root x = `found` of its slope ∂function/∂x.

    There its derivative is that at fixed x; those of higher order need the derivatives of x, as in
    `implicit`.
    """
    del slope
    return function(found, parameters)


@at_turn.defjvp
def _(
    function: Callable[..., Float[Array, "..."]],
    slope: Callable[..., Float[Array, "..."]],
    primals: tuple[PyTree, ...],
    tangents: tuple[PyTree, ...],
) -> tuple[PyTree, ...]:
    found, parameters = primals
    x = implicit(slope, found, parameters)
    return jax.jvp(lambda p: function(x, p), (parameters,), (tangents[1],))
