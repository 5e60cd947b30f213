"""Selection of one parameter of a system."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from impactjax._refusal import check_function, check_kind, check_number
from impactjax._types import Scalar

System = TypeVar("System", bound=eqx.Module)
Where: TypeAlias = Callable[[Any], PyTree]  # of a system of the caller's class


def place_of(system: eqx.Module, where: Where) -> int:
    """The index, among the leaves of a system of arrays, of the number that `where` selects.

    **Raises** `ValueError` if that is not one real number.
    """
    check_function("where", where)
    leaves, structure = jax.tree.flatten(system)
    marks = [object() for _ in leaves]  # with which nothing can be computed
    refusal = ValueError(
        "Argument `where` must select one real number of the system, such as "
        "`lambda system: system.amplitude`."
    )
    try:
        chosen = jax.tree.leaves(where(jax.tree.unflatten(structure, marks)))
    except TypeError as error:
        raise refusal from error
    found = [number for number, mark in enumerate(marks) if any(mark is each for each in chosen)]
    if len(chosen) != 1 or len(found) != 1:
        raise refusal
    leaf = leaves[found[0]]
    if not (eqx.is_inexact_array(leaf) and leaf.ndim == 0):
        raise refusal
    return found[0]


def with_value(system: System, place: int, value: Scalar) -> System:
    """The system with another number at a place."""
    leaves, structure = jax.tree.flatten(system)
    leaves[place] = jnp.asarray(value, leaves[place].dtype)
    return jax.tree.unflatten(structure, leaves)


def range_of(name: str, between: tuple[float, float], value: float) -> tuple[float, float]:
    """The two ends of a range around a value of a parameter, as floats.

    **Raises** `ValueError` for anything else, and `TypeError` for what are no two numbers.
    """
    check_kind(name, between, Sequence, "(0.1, 0.2)")
    for end in between:
        check_number(name, end)
    if len(between) != 2 or not np.all(np.isfinite(between)):
        raise ValueError(f"Argument `{name}` must be two finite numbers, but it is {between}.")
    low, high = float(between[0]), float(between[1])
    if not low <= value <= high or low == high:
        raise ValueError(
            f"Argument `{name}` must be a range around the value of the parameter, {value}, but it "
            f"is {low} to {high}."
        )
    return low, high
