"""State and mode at given times, from the logged steps."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from impactjax._hybrid.chunks import FEW_STEPS, map_rows
from impactjax._hybrid.equations import Equations, choose
from impactjax._hybrid.lane import Point, Record
from impactjax._hybrid.pairs import in_blocks, pairs_of
from impactjax._hybrid.path import Path
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import Mode, State
from impactjax._types import Samples, Scalar

_ROUNDING = 8.0  # units in the last place of a time


def last_taken(record: Record) -> Array:
    """Number of the last row that holds a step; −1 if none does."""
    numbers = jnp.arange(record.log.t.shape[0], dtype=jnp.int32)
    return jnp.max(jnp.where(record.log.taken, numbers, -1))


def sample(
    step: AbstractFlowStep,
    equations: Equations,
    start: Point,
    path: Path,
    record: Record,
    ts: Samples,
) -> tuple[State, Mode]:
    """State and mode at the times `ts`; at an event, those after it."""
    log, times = record.log, in_blocks(ts)
    blocks = times.shape[0]
    pairs = pairs_of(log.t, log.taken, record.passes, jax.lax.stop_gradient(ts))
    few = pairs.step.shape[0] < log.t.shape[0]  # most steps contain no sample

    def states(pair: tuple[Array, Array]) -> tuple[State, Mode]:
        row, block = pair
        own, own_log = _at(path._replace(expansion=()), row), _at(log, row)
        if few:
            expansion = step.expand(equations, own.t, own.y, own_log.mode, own_log.unit)
        else:
            expansion = _at(path.expansion, row)
        begin, h = own_log.t, own_log.h
        waits = begin + h < jax.lax.stop_gradient(own.next_t)

        def at(ts: Scalar) -> tuple[State, Mode]:
            s = ts - begin
            later = waits & (s > h)
            end = h + _ROUNDING * jnp.finfo(h.dtype).eps * jnp.abs(begin)
            inside = jnp.where((s >= 0) & (s <= end), s, 0.0)  # far outside it may overflow
            y = step.evaluate(equations, own.y, own_log.mode, expansion, inside, own.t - begin)
            return choose(later, (own.next_y, own_log.next_mode), (y, own_log.mode))

        return jax.vmap(at)(times[block])

    rows = pairs.step, pairs.block
    values = map_rows(states, rows, blocks + record.passes, blocks + FEW_STEPS)
    sampled = jax.tree.map(
        lambda column: column.reshape(-1, *column.shape[2:])[pairs.place], values
    )
    early = ts < start.t

    def unless_early(first: Array, column: Array) -> Array:
        return jnp.where(early.reshape(-1, *[1] * first.ndim), first, column)

    return jax.tree.map(unless_early, (start.y, start.mode), sampled)


def _at(columns: PyTree, row: Array) -> PyTree:
    return jax.tree.map(lambda column: column[row], columns)
