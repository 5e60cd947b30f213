"""Checks of a model and its start, with a readable error for each mistake."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import ArrayLike, PyTree

from impactjax._hybrid.arguments import as_number, real
from impactjax._known import AnyArray
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState, check_angle
from impactjax._parameter import ranges
from impactjax._refusal import check_kind
from impactjax._simulate.lane_state import LaneState, lane_state_at
from impactjax._simulate.step import AbstractStep
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


def check_numbers(model: ImpactOscillator) -> None:
    """Checks that each parameter of a model is one number."""
    for part in model.parts().values():
        for name in ranges(part):
            shape = jnp.shape(getattr(part, name))
            if shape:
                raise ValueError(
                    f"`{name}` of {type(part).__name__} has shape {shape}, but a run takes one "
                    "number: simulate several by `jax.vmap`."
                )


def check_start(
    model: ImpactOscillator,
    initial: InitialState | LaneState,
    ts: AnyArray,
    t0: ArrayLike | None,
) -> AnyArray:
    """Time at which a run begins, after checks of its start."""
    if isinstance(initial, LaneState):
        if t0 is not None:
            raise ValueError(
                "Argument `t0` must be left out in a run that goes on from another: it begins "
                "where that one has ended."
            )
        if jnp.shape(initial.point.t):
            raise ValueError("Argument `initial` holds several states: use `jax.vmap`.")
        return real("initial.point.t", initial.point.t)
    check_kind("initial", initial, InitialState, "InitialState(0.78)` or `trajectory.final")
    for name, value in (("position", initial.position), ("velocity", initial.velocity)):
        if jnp.shape(value):
            raise ValueError(
                f"`{name}` of the initial state has shape {jnp.shape(value)}, but a run takes one "
                "number: simulate several by `jax.vmap`."
            )
    check_angle(model.oscillator, initial)
    return as_number("t0", ts[0] if t0 is None else t0)


def check_suits(state: LaneState, step: AbstractStep, model: ImpactOscillator) -> None:
    """Checks that a run may go on from another: with a model of the same kind, the same step, and
    numbers of the same precision.
    """
    number = jax.ShapeDtypeStruct((), state.point.t.dtype)
    asked = jax.eval_shape(partial(lane_state_at, step), model, number, InitialState(0.0, 0.0))
    if _kind(state) != _kind(asked):
        raise ValueError(
            "Argument `initial` comes from a run of another kind: laws, stops, step and precision "
            "must be the same in both runs."
        )


def _kind(state: LaneState) -> tuple[object, list[tuple[object, object]]]:
    leaves, structure = jax.tree.flatten(state)
    return structure, [(leaf.shape, leaf.dtype) for leaf in leaves]


def check_leaves(tree: PyTree) -> None:
    """Checks that a tree holds nothing but numbers."""
    for path, leaf in jax.tree.leaves_with_path(tree):
        if not eqx.is_array_like(leaf):
            raise ValueError(
                f"`{jax.tree_util.keystr(path[1:])}` of the model or its start is {leaf!r}, not a "
                "number; make it a static field, `equinox.field(static=True)`."
            )
