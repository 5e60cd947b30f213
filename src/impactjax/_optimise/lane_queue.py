"""Queue of lanes: many iterations in one batch, where a lane that has ended makes room for another.

In a loop under `vmap` all lanes wait for the slowest. Here a few slots are iterated side by side,
and a slot whose lane has ended takes the next lane of the queue. Five lanes that take 3, 1, 1, 2
and 1 iterations, in two slots:

    iteration   1  2  3  4
    slot 0      a  a  a  e
    slot 1      b  c  d  d

Under `vmap` the lanes of all batch members share one queue. Each lane then has the number of its
*group*: the row of the data that belongs to its batch member.
"""

import dataclasses
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Bool, Int, PyTree

from impactjax._types import Flag

_FEWEST, _MOST = 8, 24  # slots; the data of as many lanes fit into the cache of a core

Data = TypeVar("Data", bound=PyTree)
Lane = TypeVar("Lane", bound=PyTree)
S = TypeVar("S", bound=PyTree)
R = TypeVar("R", bound=PyTree)


@dataclasses.dataclass(frozen=True, eq=False)
class Iteration(Generic[Data, Lane, S, R]):
    """An iteration as four functions.

    - `init`: the first state.
    - `step`: the next state.
    - `done`: true if a state is the last.
    - `result`: the result, from the last state.
    """

    init: Callable[[Data, Lane], S]
    step: Callable[[Data, Lane, S], S]
    done: Callable[[S], Flag]
    result: Callable[[S], R]


def in_turn(iteration: Iteration[Data, Lane, S, R], data: Data, lanes: Lane) -> R:
    """The result for each lane. Under `vmap` the lanes of all batch members share one queue.
    Forward mode differentiates through every iteration; there is no reverse mode.

    **Arguments:**

    - `iteration`: its functions, each of the data, a lane and a state.
    - `data`: arrays that all lanes share; the iteration closes over no others.
    - `lanes`: arrays whose first axis counts the lanes.
    """

    @jax.custom_jvp
    def run(data: Data, lanes: Lane) -> R:
        count = jax.tree.leaves(lanes)[0].shape[0]
        groups = jax.tree.map(lambda x: x[None], data)
        return _queued(iteration)(groups, jnp.zeros(count, jnp.int32), lanes)

    def tangents_too(primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]) -> tuple[R, R]:
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
    """The results by a plain loop under `vmap`, which JAX can differentiate."""

    def one(lane: Lane) -> R:
        end = jax.lax.while_loop(
            lambda state: ~iteration.done(state),
            lambda state: iteration.step(data, lane, state),
            iteration.init(data, lane),
        )
        return iteration.result(end)

    return jax.vmap(one)(lanes)


def _queued(iteration: Iteration[Data, Lane, S, R]) -> Callable[[Data, Int[Array, "..."], Lane], R]:
    """The results of lanes, each with the data of its group, as a function that `vmap` turns into
    a longer queue.

    A batch of m members of n lanes becomes m n lanes in m times as many groups: with one group to
    begin with, lane i of member j gets group j.
    """

    @jax.custom_batching.custom_vmap
    def run(data: Data, group: Int[Array, " lanes"], lanes: Lane) -> R:
        return _run(iteration, data, group, lanes)

    @run.def_vmap
    def _(
        size: int, batched: list[PyTree], data: Data, group: Int[Array, "..."], lanes: Lane
    ) -> tuple[PyTree, ...]:
        data_batched, group_batched, lanes_batched = batched
        group = _everywhere(size, group, group_batched)
        if any(jax.tree.leaves(data_batched)):
            data = jax.tree.map(lambda x, on: _everywhere(size, x, on), data, data_batched)
            groups = jax.tree.leaves(data)[0].shape[1]
            group = group + groups * jnp.arange(size, dtype=group.dtype)[:, None]
            data = _merged(data)
        lanes = jax.tree.map(lambda x, on: _everywhere(size, x, on), lanes, lanes_batched)
        results = run(data, group.reshape(-1), _merged(lanes))
        results = jax.tree.map(lambda x: x.reshape(size, -1, *x.shape[1:]), results)
        return results, jax.tree.map(lambda _: True, results)

    return run


def _everywhere(size: int, x: Array, batched: bool) -> Array:
    """An array with a batch axis first, repeated if it has none."""
    return x if batched else jnp.broadcast_to(x, (size, *x.shape))


def _merged(tree: PyTree) -> PyTree:
    """A tree whose arrays have their first two axes merged."""
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), tree)


def _slots(count: int) -> int:
    """Number of slots: on a CPU few, so that a lane that has ended has one to follow it; on other
    devices one for each lane.
    """
    if jax.default_backend() != "cpu":
        return count
    return min(count, max(_FEWEST, min(count // _FEWEST, _MOST)))


class _Queue(NamedTuple):
    """State of the queue: slots at work, the next lane to take, and the results so far."""

    lane: Int[Array, " slots"]  # the lane in each slot; an index past the last lane: slot empty
    states: PyTree
    next: Int[Array, ""]
    results: PyTree


def _kept(results: R, lane: Int[Array, " slots"], done: Bool[Array, " slots"], found: R) -> R:
    """The results, with those of the lanes that ended written in place one after the other."""
    slots = jnp.argsort(~done)

    def write(k: Int[Array, ""], results: R) -> R:
        slot = slots[k]
        return jax.tree.map(
            lambda x, new: jax.lax.dynamic_update_index_in_dim(x, new[slot], lane[slot], 0),
            results,
            found,
        )

    return jax.lax.fori_loop(0, jnp.sum(done), write, results)


def _run(
    iteration: Iteration[Data, Lane, S, R], data: Data, group: Int[Array, " lanes"], lanes: Lane
) -> R:
    """Works off the queue. Each turn iterates all slots once, stores the results of those that
    ended, and gives them the next lanes.
    """
    count = group.shape[0]
    alone = jax.tree.leaves(data)[0].shape[0] == 1

    def given(i: Int[Array, ""]) -> tuple[Data, Lane]:
        row = 0 if alone else group[i]
        return jax.tree.map(lambda x: x[row], data), jax.tree.map(lambda x: x[i], lanes)

    def init(i: Int[Array, ""]) -> S:
        return iteration.init(*given(i))

    def step(i: Int[Array, ""], state: S) -> S:
        return iteration.step(*given(i), state)

    def turn(queue: _Queue) -> _Queue:
        lane, states, following, results = queue
        states = jax.vmap(step)(jnp.minimum(lane, count - 1), states)
        done = jax.vmap(iteration.done)(states)
        found = jax.vmap(iteration.result)(states)
        results = _kept(results, lane, done & (lane < count), found)
        lane = jnp.where(done, following + jnp.cumsum(done, dtype=jnp.int32) - 1, lane)
        fresh = jax.vmap(init)(jnp.minimum(lane, count - 1))
        states = jax.tree.map(
            lambda new, old: jnp.where(done.reshape(-1, *(1,) * (new.ndim - 1)), new, old),
            fresh,
            states,
        )
        return _Queue(lane, states, following + jnp.sum(done, dtype=jnp.int32), results)

    first = jnp.arange(_slots(count), dtype=jnp.int32)
    states = jax.vmap(init)(first)
    shapes = jax.eval_shape(lambda: iteration.result(init(jnp.int32(0))))
    results = jax.tree.map(lambda x: jnp.zeros((count, *x.shape), x.dtype), shapes)
    queue = _Queue(first, states, jnp.int32(first.size), results)
    return jax.lax.while_loop(lambda queue: jnp.any(queue.lane < count), turn, queue).results
