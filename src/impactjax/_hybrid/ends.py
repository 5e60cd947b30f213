"""Start and end of a run of a hybrid system."""

from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

from impactjax._hybrid.default_step import default_step
from impactjax._hybrid.equations import NO_EVENT, Equations, alike_in_shape
from impactjax._hybrid.lane import Memory, Point, Record, Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.path import Path
from impactjax._hybrid.sampled import last_taken
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import State
from impactjax._known import AnyArray, is_known
from impactjax._refusal import check_kind

T = TypeVar("T")


def with_arrays(tree: T, dtype: np.dtype) -> T:
    """A tree with its floating-point numbers as arrays, so that their values cause no retrace."""
    return jax.tree.map(
        lambda leaf: jnp.asarray(leaf, dtype) if isinstance(leaf, float) else leaf, tree
    )


def as_start(start: Start, dtype: np.dtype) -> Start:
    """A start made of arrays."""
    y = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), start.y)
    if not jax.tree.leaves(y):
        raise ValueError("Argument `start` has a state without numbers.")
    mode = jax.tree.map(_as_mode, start.mode)
    return Start(jnp.asarray(start.t, dtype), y, mode, start.memory)


def _as_mode(leaf: ArrayLike) -> Array:
    array = jnp.asarray(leaf)
    if jnp.issubdtype(array.dtype, jnp.floating):
        raise TypeError(f"The mode of a start must be made of whole numbers, but it holds {leaf}.")
    return array if array.dtype == bool else array.astype(jnp.int32)


def as_scale(scale: State | None, y: State, dtype: np.dtype) -> State:
    """Sizes below which numbers need no accuracy; zeros if left out.

    **Raises** `ValueError` for a size that is negative.
    """
    like = jax.tree.map(lambda leaf: jnp.zeros(jnp.shape(leaf), dtype), y)
    if scale is None:
        return like
    sizes = alike_in_shape("scale", scale, like)
    if is_known(sizes) and not all(np.all(leaf >= 0) for leaf in jax.tree.leaves(sizes)):
        raise ValueError(f"Argument `scale` must hold sizes of at least 0, but it is {scale}.")
    return sizes


def flow_step(
    method: AbstractMethod | None, equations: Equations, start: Start, tolerance: AnyArray
) -> AbstractFlowStep:
    """The step of a run: of a given method, or the default."""
    if method is None:
        return default_step(equations, start, tolerance)
    check_kind("step", method, AbstractMethod, "TaylorStep()")
    return method.of_flows()


def begin(step: AbstractFlowStep, equations: Equations, start: Start) -> Point:
    """The first point, with what the lane remembers."""
    t, y, mode = jnp.asarray(start.t), start.y, start.mode
    if start.memory is not None:
        return Point(t, y, mode, start.memory)
    guards = equations.guard_values(t, y, mode)
    memory = Memory(
        guards >= 0,
        jnp.int32(NO_EVENT),
        jnp.zeros((), bool),
        jnp.int32(0),
        t,
        jnp.zeros((), bool),
        step.begin(equations, t, y, mode),
    )
    return Point(t, y, mode, jax.lax.stop_gradient(memory))


def final_of(start: Point, path: Path, record: Record) -> Start:
    """Start of the next run, with derivatives."""
    row = last_taken(record)
    end = jax.tree.map(lambda column: column[row], (path.next_t, path.next_y))
    t, y = jax.tree.map(lambda new, old: jnp.where(row >= 0, new, old), end, (start.t, start.y))
    return Start(t, y, record.final.mode, record.final.memory)
