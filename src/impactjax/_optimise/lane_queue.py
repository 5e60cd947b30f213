"""Many iterations in one batch, each as long as it takes: where one ends, the next one begins.

In a loop under `vmap` all lanes wait for the slowest.
"""

import dataclasses
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Bool, Int, PyTree

from impactjax._types import Flag

_FEWEST, _MOST = 8, 24  # lanes at work at a time, whose data fit into the cache of a core

Data = TypeVar("Data", bound=PyTree)
Lane = TypeVar("Lane", bound=PyTree)
S = TypeVar("S", bound=PyTree)
R = TypeVar("R", bound=PyTree)


@dataclasses.dataclass(frozen=True, eq=False)
class Iteration(Generic[Data, Lane, S, R]):
    """What is done for each lane.

    - `begin`: the first state.
    - `go_on`: the next one.
    - `ended`: whether a state is the last.
    - `result`: what the last state tells.
    """

    begin: Callable[[Data, Lane], S]
    go_on: Callable[[Data, Lane, S], S]
    ended: Callable[[S], Flag]
    result: Callable[[S], R]


def in_turn(iteration: Iteration[Data, Lane, S, R], data: Data, lanes: Lane) -> R:
    """The result for each lane; the data are those of all. Under `vmap` all lanes of all members
    are one queue; derivatives, in forward mode, are those of every iteration.

    **Arguments:**

    - `data`: arrays, and all that the iteration depends on.
    - `lanes`: arrays with an axis of lanes first.
    """

    @jax.custom_jvp
    def run(data: Data, lanes: Lane) -> R:
        count = jax.tree.leaves(lanes)[0].shape[0]
        groups = jax.tree.map(lambda x: x[None], data)
        return _queued(iteration)(groups, jnp.zeros(count, jnp.int32), lanes)

    def tangents_too(primals: tuple, tangents: tuple) -> tuple[R, R]:
        values, structure = jax.tree.flatten(primals)
        slopes = jax.tree.leaves(tangents)
        varied = [i for i, slope in enumerate(slopes) if not isinstance(slope, SymbolicZero)]

        def of_varied(*some: Array) -> R:
            every = list(values)
            for i, value in zip(varied, some, strict=True):
                every[i] = value
            return _side_by_side(iteration, *jax.tree.unflatten(structure, every))

        return jax.jvp(of_varied, [values[i] for i in varied], [slopes[i] for i in varied])

    run.defjvp(tangents_too, symbolic_zeros=True)
    return run(data, lanes)


def _side_by_side(iteration: Iteration[Data, Lane, S, R], data: Data, lanes: Lane) -> R:
    """The same as a loop under `vmap`."""

    def one(lane: Lane) -> R:
        end = jax.lax.while_loop(
            lambda state: ~iteration.ended(state),
            lambda state: iteration.go_on(data, lane, state),
            iteration.begin(data, lane),
        )
        return iteration.result(end)

    return jax.vmap(one)(lanes)


def _queued(iteration: Iteration[Data, Lane, S, R]) -> Callable[[Data, Int[Array, "..."], Lane], R]:
    """The results for lanes with data of their groups; `vmap` makes more lanes of it."""

    @jax.custom_batching.custom_vmap
    def run(data: Data, of: Int[Array, " lanes"], lanes: Lane) -> R:
        return _run(iteration, data, of, lanes)

    @run.def_vmap
    def _(size: int, batched: list, data: Data, of: Int[Array, "..."], lanes: Lane) -> tuple:
        of_data, of_of, of_lanes = batched
        of = _everywhere(size, of, of_of)
        if any(jax.tree.leaves(of_data)):
            data = jax.tree.map(lambda x, own: _everywhere(size, x, own), data, of_data)
            groups = jax.tree.leaves(data)[0].shape[1]
            of = of + groups * jnp.arange(size, dtype=of.dtype)[:, None]
            data = _merged(data)
        lanes = jax.tree.map(lambda x, own: _everywhere(size, x, own), lanes, of_lanes)
        found = run(data, of.reshape(-1), _merged(lanes))
        found = jax.tree.map(lambda x: x.reshape(size, -1, *x.shape[1:]), found)
        return found, jax.tree.map(lambda _: True, found)

    return run


def _everywhere(size: int, x: Array, batched: bool) -> Array:
    return x if batched else jnp.broadcast_to(x, (size, *x.shape))


def _merged(tree: PyTree) -> PyTree:
    """The first two axes as one."""
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), tree)


def _slots(count: int) -> int:
    """How many lanes are at work at a time: few enough to have others to follow, but all of them on
    a device made for many.
    """
    if jax.default_backend() != "cpu":
        return count
    return min(count, max(_FEWEST, min(count // _FEWEST, _MOST)))


class _Queue(NamedTuple):
    lane: Int[Array, " slots"]  # at work in each slot; beyond the last one none is left
    states: PyTree
    next: Int[Array, ""]
    results: PyTree


def _kept(results: R, lane: Int[Array, " slots"], ended: Bool[Array, " slots"], found: R) -> R:
    """The results with those of the lanes that ended, written one after the other in place."""
    slots = jnp.argsort(~ended)

    def write(k: Int[Array, ""], results: R) -> R:
        slot = slots[k]
        return jax.tree.map(
            lambda x, new: jax.lax.dynamic_update_index_in_dim(x, new[slot], lane[slot], 0),
            results,
            found,
        )

    return jax.lax.fori_loop(0, jnp.sum(ended), write, results)


def _run(
    iteration: Iteration[Data, Lane, S, R], data: Data, of: Int[Array, " lanes"], lanes: Lane
) -> R:
    count = of.shape[0]
    alone = jax.tree.leaves(data)[0].shape[0] == 1

    def given(i: Int[Array, ""]) -> tuple[Data, Lane]:
        group = 0 if alone else of[i]
        return jax.tree.map(lambda x: x[group], data), jax.tree.map(lambda x: x[i], lanes)

    def begin(i: Int[Array, ""]) -> S:
        return iteration.begin(*given(i))

    def go_on(i: Int[Array, ""], state: S) -> S:
        return iteration.go_on(*given(i), state)

    def turn(queue: _Queue) -> _Queue:
        lane, states, following, results = queue
        states = jax.vmap(go_on)(jnp.minimum(lane, count - 1), states)
        ended = jax.vmap(iteration.ended)(states)
        found = jax.vmap(iteration.result)(states)
        results = _kept(results, lane, ended & (lane < count), found)
        lane = jnp.where(ended, following + jnp.cumsum(ended, dtype=jnp.int32) - 1, lane)
        fresh = jax.vmap(begin)(jnp.minimum(lane, count - 1))
        states = jax.tree.map(
            lambda new, old: jnp.where(ended.reshape(-1, *(1,) * (new.ndim - 1)), new, old),
            fresh,
            states,
        )
        return _Queue(lane, states, following + jnp.sum(ended, dtype=jnp.int32), results)

    first = jnp.arange(_slots(count), dtype=jnp.int32)
    states = jax.vmap(begin)(first)
    shapes = jax.eval_shape(lambda: iteration.result(begin(jnp.int32(0))))
    results = jax.tree.map(lambda x: jnp.zeros((count, *x.shape), x.dtype), shapes)
    queue = _Queue(first, states, jnp.int32(first.size), results)
    return jax.lax.while_loop(lambda queue: jnp.any(queue.lane < count), turn, queue).results
