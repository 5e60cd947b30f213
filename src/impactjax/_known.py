"""Numbers that are known, which NumPy computes with at once, and those that JAX traces."""

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
    """Whether all arrays of a tree have values already."""
    return not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(tree))


def known(tree: T) -> T:
    """The same with its known numbers as NumPy's; what JAX traces stays."""

    def plain(leaf: PyTree) -> PyTree:
        own = isinstance(leaf, jax.Array) and not isinstance(leaf, Tracer)
        return np.asarray(leaf) if own else leaf

    return jax.tree.map(plain, tree)


def namespace(*trees: PyTree) -> ModuleType:
    """The module that computes with some numbers: NumPy, if all are its own."""
    of_jax = any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(trees))
    return jnp if of_jax else np


def either(condition: Bool[AnyArray, ""], yes: Callable[[], T], no: T) -> T:
    """One of two trees; where NumPy knows the condition, the first is made only if it is chosen."""
    if isinstance(condition, np.ndarray | np.generic):
        return yes() if condition else no
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes(), no)
