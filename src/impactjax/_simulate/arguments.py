"""Checks of a model and its start, with a readable error for each mistake."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import PyTree

from impactjax._hybrid.arguments import real
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._parameter import ranges
from impactjax._types import Factors, Numbers


def as_factors(factors: Numbers, dtype: np.dtype) -> Factors:
    """The factors of a run, one for each impact."""
    array = jnp.asarray(real("factors", factors), dtype)
    if array.ndim != 1 or array.size == 0:
        raise ValueError(
            f"Argument `factors` must be a list of numbers, one for each impact, but its shape is "
            f"{array.shape}."
        )
    if not isinstance(array, Tracer) and not np.all(np.asarray(array) > 0):
        raise ValueError("Argument `factors` must be positive.")
    return array


def check_numbers(model: ImpactOscillator, initial: InitialState) -> None:
    """Checks that each parameter, and each part of the state, is one number."""
    for name, value in (("position", initial.position), ("velocity", initial.velocity)):
        if jnp.shape(value):
            raise ValueError(
                f"`{name}` of the initial state has shape {jnp.shape(value)}, but a run takes one "
                "number: simulate several by `jax.vmap`."
            )
    for part in model.parts().values():
        for name in ranges(part):
            shape = jnp.shape(getattr(part, name))
            if shape:
                raise ValueError(
                    f"`{name}` of {type(part).__name__} has shape {shape}, but a run takes one "
                    "number: simulate several by `jax.vmap`."
                )


def check_leaves(tree: PyTree) -> None:
    """Checks that a tree holds nothing but numbers."""
    for path, leaf in jax.tree.leaves_with_path(tree):
        if not eqx.is_array_like(leaf):
            raise ValueError(
                f"`{jax.tree_util.keystr(path[1:])}` of the model or its start is {leaf!r}, not a "
                "number; make it a static field, `equinox.field(static=True)`."
            )
