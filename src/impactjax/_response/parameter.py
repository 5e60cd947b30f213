"""Selection of one parameter of a system."""

from collections.abc import Callable
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from impactjax._hybrid.system import HybridSystem
from impactjax._types import Scalar

Where: TypeAlias = Callable[[Any], PyTree]  # of a system of the caller's class


def place_of(system: HybridSystem, where: Where) -> int:
    """The index, among the leaves of a system of arrays, of the number that `where` selects.

    **Raises** `ValueError` if that is not one real number.
    """
    leaves, structure = jax.tree.flatten(system)
    chosen = jax.tree.leaves(where(jax.tree.unflatten(structure, range(len(leaves)))))
    selects = len(chosen) == 1 and isinstance(chosen[0], int)
    if not (selects and eqx.is_inexact_array(leaves[chosen[0]]) and leaves[chosen[0]].ndim == 0):
        raise ValueError(
            "Argument `where` must select one real number of the system, such as "
            "`lambda system: system.amplitude`."
        )
    return chosen[0]


def with_value(system: HybridSystem, place: int, value: Scalar) -> HybridSystem:
    """The system with another number at a place."""
    leaves, structure = jax.tree.flatten(system)
    leaves[place] = jnp.asarray(value, leaves[place].dtype)
    return jax.tree.unflatten(structure, leaves)
