"""Disturbances of a motion: tangent vectors that run beside it."""

from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from impactjax._types import Scalar

Told = TypeVar("Told")
Vectors = TypeVar("Vectors")


def axes(numbers: tuple[Scalar, ...]) -> tuple[Array, ...]:
    """Disturbances of each of some numbers alone, one a row of each leaf."""
    return tuple(jnp.eye(len(numbers), dtype=numbers[0].dtype))


def pushed(
    function: Callable[[Any], Told], point: PyTree, disturbances: PyTree
) -> tuple[Told, Any]:
    """Values of a function at a point, and how disturbances of the point change its floats.

    Disturbances have the structure of the floats of the point, each leaf with an axis before.
    """
    floats, others = eqx.partition(point, eqx.is_inexact_array)

    def of_floats(floats: PyTree) -> tuple[PyTree, PyTree]:
        return eqx.partition(function(eqx.combine(floats, others)), eqx.is_inexact_array)

    def along(disturbance: PyTree) -> tuple[PyTree, PyTree, PyTree]:
        return jax.jvp(of_floats, (floats,), (disturbance,), has_aux=True)

    told, changes, rest = jax.vmap(along, out_axes=(None, 0, None))(disturbances)
    return eqx.combine(told, rest), changes


def orthogonal(
    disturbances: Vectors, ends: Float[Array, "2 2"]
) -> tuple[Vectors, Float[Array, "2"]]:
    """The same two disturbances with orthonormal ends, and the logarithms of their sizes before.

    By the method of Gram and Schmidt; `ends` has a row for each. One that is zero stays so.
    """
    first, second = ends
    along = _over(first, jnp.linalg.norm(first))
    shared = along @ second
    sizes = jnp.stack([jnp.linalg.norm(first), jnp.linalg.norm(second - shared * along)])

    def combined(leaf: Array) -> Array:
        unit = _over(leaf[0], sizes[0])
        return jnp.stack([unit, _over(leaf[1] - shared * unit, sizes[1])])

    return jax.tree.map(combined, disturbances), jnp.log(sizes)


def _over(numbers: Array, size: Scalar) -> Array:
    """The numbers over a size, or zeros where it is zero."""
    return jnp.where(size > 0, numbers / jnp.where(size > 0, size, 1.0), 0.0)
