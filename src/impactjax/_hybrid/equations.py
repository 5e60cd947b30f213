"""The equations of a hybrid system, with the shapes and types that the engine needs."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from impactjax._hybrid.system import HybridSystem, Mode, State, Transition
from impactjax._refusal import check_kind
from impactjax._types import Code, Flag, Scalar

NO_EVENT = -1


class Jump(NamedTuple):
    """State and mode after an event.

    - `wait`: duration of an endless series of events that was taken at once.
    - `ends`: true if the run ends.
    """

    y: State
    mode: Mode
    wait: Scalar
    ends: Flag


class Equations(eqx.Module):
    """Flow, guards and jumps of a system."""

    system: HybridSystem

    def flow(self, t: Scalar, y: State, mode: Mode) -> State:
        """Time derivative of the state."""
        return alike_in_shape("flow", self.system.flow(t, y, mode), y)

    def smooth_for(self, t: Scalar, mode: Mode) -> Scalar:
        """Time for which the flow is smooth from `t` on."""
        until = self.system.smooth_until(t, mode)
        return jnp.full_like(t, jnp.inf) if until is None else jnp.asarray(until, t.dtype) - t

    def count(self) -> int:
        """Number of transitions."""
        return len(self.transitions())

    def transitions(self) -> Sequence[Transition]:
        """The transitions of the system."""
        found = self.system.transitions()
        for each in found:
            check_kind("transitions", each, Transition, "Transition(guard, jump)")
        return found

    def guards(self, t: Scalar, y: State, mode: Mode) -> list[Scalar]:
        """One value for each transition."""
        return [_guard(number, each, t, y, mode) for number, each in enumerate(self.transitions())]

    def guard_values(self, t: Scalar, y: State, mode: Mode) -> Float[Array, " guards"]:
        """The guards as one array."""
        values = self.guards(t, y, mode)
        return jnp.stack(values) if values else jnp.zeros(0, t.dtype)

    def jump(
        self, event: Code, t: Scalar, y: State, mode: Mode, towards: Mode | None = None
    ) -> Jump:
        """State and mode after the transition numbered `event`; unchanged for `NO_EVENT`. With
        `towards`, an endless series is summed where that alone leads to this mode, else where its
        tail holds.
        """
        after = Jump(y, mode, jnp.zeros_like(t), jnp.zeros((), bool))
        for number, transition in enumerate(self.transitions()):
            taken = _taken(transition, t, y, mode, towards)
            after = choose(event == number, taken, after)
        return after


def _guard(number: int, transition: Transition, t: Scalar, y: State, mode: Mode) -> Scalar:
    value = jnp.asarray(transition.guard(t, y, mode), t.dtype)
    if value.shape:
        raise ValueError(
            f"The guard of transition {number} must be one number, but its shape is {value.shape}."
        )
    return value


def _taken(transition: Transition, t: Scalar, y: State, mode: Mode, towards: Mode | None) -> Jump:
    nothing = jnp.zeros_like(t)
    if transition.jump is None:
        return Jump(y, mode, nothing, jnp.ones((), bool))
    y_after, mode_after = transition.jump(t, y, mode)
    after = Jump(
        alike_in_shape("jump", y_after, y),
        alike_in_shape("jump", mode_after, mode),
        nothing,
        jnp.zeros((), bool),
    )
    if transition.tail is None:
        return after
    tail = transition.tail(t, after.y, after.mode)
    summed = after._replace(
        y=alike_in_shape("tail", tail.y, y),
        mode=alike_in_shape("tail", tail.mode, mode),
        wait=jnp.asarray(tail.duration, t.dtype),
    )
    holds = jnp.asarray(tail.holds)
    if towards is not None:
        sums, jumps = same(summed.mode, towards), same(after.mode, towards)
        holds = jnp.where(sums == jumps, holds, sums)
    return choose(holds, summed, after)


def alike_in_shape(name: str, tree: PyTree, like: PyTree) -> PyTree:
    """A tree with the structure, shapes and types of another one.

    **Raises** `ValueError` if the structure is different or a shape does not broadcast.
    """
    if jax.tree.structure(tree) != jax.tree.structure(like):
        raise ValueError(
            f"`{name}` gives a tree of the structure {jax.tree.structure(tree)}, but it must be "
            f"{jax.tree.structure(like)}."
        )

    def shaped(path: tuple[object, ...], leaf: PyTree, like: Array) -> Array:
        if jnp.broadcast_shapes(jnp.shape(leaf), like.shape) != like.shape:
            raise ValueError(
                f"`{name}` gives an array of shape {jnp.shape(leaf)} at "
                f"`{jax.tree_util.keystr(path)}`, but it must be {like.shape}."
            )
        return jnp.broadcast_to(jnp.asarray(leaf, like.dtype), like.shape)

    return jax.tree_util.tree_map_with_path(shaped, tree, like)


def same(mode: Mode, other: Mode) -> Flag:
    """True if two modes are equal."""
    equal = jax.tree.map(lambda a, b: jnp.all(a == b), mode, other)
    return jnp.all(jnp.stack(jax.tree.leaves(equal)))


def choose(condition: Flag, yes: PyTree, no: PyTree) -> PyTree:
    """One of two trees, leaf by leaf."""
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)
