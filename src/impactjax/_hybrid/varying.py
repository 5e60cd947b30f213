"""Adjustment of the mesh axes over which values vary, inside `jax.shard_map`."""

import functools
import operator
from typing import TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

T = TypeVar("T")


def alike(tree: T, like: PyTree) -> T:
    """A tree whose leaves vary over every mesh axis that any leaf of `like` varies over.

    Both branches of a condition, and a loop's state before and after a pass, must agree in this.
    Outside `jax.shard_map` nothing varies, and nothing happens.
    """
    if not jax.sharding.get_abstract_mesh().manual_axes:
        return tree
    first = [jnp.ravel(leaf)[0] for leaf in jax.tree.leaves(like) if leaf.size]
    varies = functools.reduce(operator.or_, [value != value for value in first])

    def varied(leaf: Array) -> Array:
        return jnp.where(varies, leaf, leaf)

    return jax.tree.map(varied, tree)
