"""Distinction of known numbers, which NumPy computes with at once, from those that JAX traces."""

from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Bool, PyTree

if TYPE_CHECKING:
    AnyArray: TypeAlias = Any  # type checkers know no common type of arrays
else:
    AnyArray = jax.Array | np.ndarray | np.generic

T = TypeVar("T")


def is_known(tree: PyTree) -> bool:
    """True if all arrays of a tree have values, so that none is traced."""
    return not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(tree))


def known(tree: T) -> T:
    """The same tree with its known arrays as NumPy arrays; traced ones stay."""

    def plain(leaf: PyTree) -> PyTree:
        own = isinstance(leaf, jax.Array) and not isinstance(leaf, Tracer)
        return np.asarray(leaf) if own else leaf

    return jax.tree.map(plain, tree)


def placed(tree: T) -> T:
    """The same tree with its NumPy arrays as arrays of JAX, for which no program is compiled."""

    def array(leaf: PyTree) -> PyTree:
        return jax.device_put(leaf) if isinstance(leaf, np.ndarray | np.generic) else leaf

    return jax.tree.map(array, tree)


def namespace(*trees: PyTree) -> ModuleType:
    """The array module for some trees: `numpy` if all arrays are NumPy's, else `jax.numpy`."""
    of_jax = any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(trees))
    return jnp if of_jax else np


def either(condition: Bool[AnyArray, ""], yes: Callable[[], T], no: T) -> T:
    """One of two trees. If the condition is known, `yes` is called only if it is chosen."""
    if isinstance(condition, np.ndarray | np.generic):
        return yes() if condition else no
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes(), no)
