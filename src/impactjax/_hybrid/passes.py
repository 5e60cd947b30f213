"""One loop of passes for a batch of lanes, with a log of one row for each pass.

Under `vmap` all lanes run in one loop, so that the pass counter is not batched, and each pass
writes one row of the log.
"""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from impactjax._hybrid.chunks import CHUNK
from impactjax._hybrid.varying import alike
from impactjax._types import Flag

Run = TypeVar("Run")
OfLanes = TypeVar("OfLanes")
Common = TypeVar("Common")
State = TypeVar("State")
Row = TypeVar("Row")


def in_one_loop(loop: Callable[[Run], tuple[OfLanes, Common]], run: Run) -> tuple[OfLanes, Common]:
    """The result of a loop over a batch of runs, for one run or, under `vmap`, for all.

    `loop` takes runs with an axis of lanes, and returns a tree with that axis and one without.
    """

    @jax.custom_batching.custom_vmap
    def batch(runs: Run) -> tuple[OfLanes, Common]:
        return loop(runs)

    @batch.def_vmap
    def _(
        size: int, batched: list[PyTree], runs: Run
    ) -> tuple[tuple[OfLanes, Common], tuple[PyTree, PyTree]]:
        def merged(x: Array, is_batched: bool) -> Array:
            x = x if is_batched else jnp.broadcast_to(x, (size, *x.shape))
            return x.reshape(size * x.shape[1], *x.shape[2:])

        lanes, common = batch(jax.tree.map(merged, runs, batched[0]))
        split = jax.tree.map(lambda x: x.reshape(size, x.shape[0] // size, *x.shape[1:]), lanes)
        yes, no = jax.tree.map(lambda _: True, split), jax.tree.map(lambda _: False, common)
        return (split, common), (yes, no)

    lanes, common = batch(jax.tree.map(lambda x: x[None], run))
    return jax.tree.map(lambda x: x[0], lanes), common


def logged_passes(
    one_pass: Callable[[State], tuple[State, Row]],
    finished: Callable[[State], Flag],
    state: State,
    empty: Row,
    count: int,
    like: PyTree,
) -> tuple[State, Row, Array]:
    """State after all passes, their log with one row each, and their number.

    **Arguments:**

    - `one_pass`: a pass, which returns the next state and a row for each lane.
    - `finished`: true if no further pass is needed.
    - `state`, `empty`: state before the first pass, and rows that say nothing.
    - `count`: largest number of passes, a multiple of `CHUNK`.
    - `like`: values that vary over the mesh axes of all lanes.
    """

    def rows(count: int) -> Row:
        return jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *x.shape)), empty)

    def unfinished(carry: tuple[State, Row, Array]) -> Flag:
        state, log, passes = carry
        return (passes < jax.tree.leaves(log)[0].shape[0]) & ~finished(state)

    def further(carry: tuple[State, Row, Array]) -> tuple[State, Row, Array]:
        state, log, passes = carry
        state, row = one_pass(state)
        log = jax.tree.map(lambda column, own: column.at[passes].set(own), log, row)
        return alike((state, log, passes + 1), like)

    def one_chunk(carry: tuple[State, Row, Array]) -> tuple[State, Row, Array]:
        """A chunk of passes with its own short log, which stays in the processor's cache."""
        state, log, passes = carry
        begin = alike((state, rows(CHUNK), jnp.int32(0)), like)
        state, chunk, more = jax.lax.while_loop(unfinished, further, begin)
        log = jax.tree.map(
            lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, passes, 0),
            log,
            chunk,
        )
        return state, log, passes + more

    start = alike((state, rows(count), jnp.int32(0)), like)
    state, log, passes = jax.lax.while_loop(unfinished, one_chunk, start)
    return state, jax.tree.map(lambda x: jnp.moveaxis(x, 0, 1), log), passes
