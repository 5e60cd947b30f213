"""State and mode at given times, from the logged steps."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from impactjax._hybrid.equations import Equations, choose
from impactjax._hybrid.lane import Point, Record
from impactjax._hybrid.path import Path
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import Mode, State
from impactjax._types import Samples, Scalar


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
    log = record.log
    numbers = jnp.arange(log.t.shape[0], dtype=jnp.int32)
    starts = jnp.where(numbers <= last_taken(record), log.t, jnp.inf)
    found = jnp.searchsorted(starts, jax.lax.stop_gradient(ts), side="right") - 1
    rows = jax.lax.cummax(jnp.where(log.taken, numbers, 0))[jnp.maximum(found, 0)]
    next_modes = jax.vmap(
        lambda row: equations.jump(row.event, row.t + row.h, row.end, row.mode).mode
    )(log)

    def one(ts: Scalar, row: Array) -> tuple[State, Mode]:
        own, own_log = _at(path, row), _at(log, row)
        begin = jax.lax.stop_gradient(own.t)
        s, h = ts - begin, jax.lax.stop_gradient(own.h)
        waits = (own_log.t + own_log.h < jax.lax.stop_gradient(own.next_t)) & (s > h)
        inside = jnp.where(waits | (s < 0), 0.0, s)  # far outside the step it may overflow
        flowed = step.evaluate(equations, own.y, own_log.mode, own.expansion, inside, own.t - begin)
        after = own.next_y, _at(next_modes, row)
        y, mode = choose(waits, after, (flowed, own_log.mode))
        return choose(ts < start.t, (start.y, start.mode), (y, mode))

    return jax.vmap(one)(ts, rows)


def _at(columns: PyTree, row: Array) -> PyTree:
    return jax.tree.map(lambda column: column[row], columns)
