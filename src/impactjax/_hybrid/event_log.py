"""The event log of a run."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.lane import Record
from impactjax._hybrid.path import Path
from impactjax._hybrid.system import Mode, State
from impactjax._types import Flag, Scalar

_SAME_TIME = 8.0  # units in the last place


class EventLog(eqx.Module):
    """The events of a lane in order of time; unused rows hold NaN, −1 and 0.

    - `t`: time of the event.
    - `transition`: number of the transition; −1 in an unused row.
    - `before`, `after`: states before and after the jump.
    - `mode_before`, `mode_after`: modes before and after it.
    - `until`: time from which `after` holds: that of the event, or the end of an endless series
      that was taken at once.
    - `order_matters`: true if another event happens at the same time, both were due before, and the
      state after them depends on which comes first.
    - `count`: number of events, of which the log holds the first ones.
    """

    t: Float[Array, "... events"]
    transition: Int[Array, "... events"]
    before: State
    after: State
    mode_before: Mode
    mode_after: Mode
    until: Float[Array, "... events"]
    order_matters: Bool[Array, "... events"]
    count: Int[Array, "..."]


def events_of(
    equations: Equations, path: Path, record: Record, tolerance: Scalar, max_events: int
) -> EventLog:
    """The first `max_events` events."""
    log = record.log
    happens = log.taken & (log.event != NO_EVENT)
    (rows,) = jnp.nonzero(happens, size=max_events, fill_value=-1)
    exists = rows >= 0
    own, own_log = jax.tree.map(lambda column: column[rows], (path, log))
    ends = own.t + own.h

    def known(column: Array, unused: float) -> Array:
        own = exists.reshape(-1, *[1] * (column.ndim - 1))
        return jnp.where(own, column, jnp.asarray(unused, column.dtype))

    def states(tree: State) -> State:
        return jax.tree.map(lambda column: known(column, jnp.nan), tree)

    def numbers(tree: Mode) -> Mode:
        return jax.tree.map(lambda column: known(column, 0), tree)

    found = EventLog(
        t=known(ends, jnp.nan),
        transition=known(own_log.event, NO_EVENT),
        before=states(own.end),
        after=states(own.next_y),
        mode_before=numbers(own_log.mode),
        mode_after=numbers(own_log.next_mode),
        until=known(own.next_t, jnp.nan),
        order_matters=jnp.zeros(max_events, bool),
        count=jnp.sum(happens, dtype=jnp.int32),
    )
    matters = _order_matters(equations, jax.lax.stop_gradient(found), tolerance)
    return eqx.tree_at(lambda log: log.order_matters, found, matters)


class _Event(NamedTuple):
    t: Array
    transition: Array
    before: State
    mode_before: Mode
    after: State
    mode_after: Mode


def _order_matters(
    equations: Equations, log: EventLog, tolerance: Scalar
) -> Bool[Array, " events"]:
    """True for each event of a pair at one time whose order matters."""

    def exchanged(first: _Event, second: _Event) -> Flag:
        t, y, mode = first.t, first.before, first.mode_before
        rounding = _SAME_TIME * jnp.finfo(t.dtype).eps * jnp.abs(t)
        together = (second.t - first.t <= rounding) & (second.transition != first.transition)
        middle = equations.jump(second.transition, t, y, mode)
        end = equations.jump(first.transition, t, middle.y, middle.mode)
        equal = jax.tree.map(
            lambda a, b, y: jnp.all(jnp.abs(a - b) <= tolerance * (jnp.abs(a) + jnp.abs(y))),
            end.y,
            second.after,
            y,
        )
        same = jax.tree.map(lambda a, b: jnp.all(a == b), end.mode, second.mode_after)
        differs = ~jnp.all(jnp.stack(jax.tree.leaves((equal, same))))
        return together & differs & _was_due(equations, first, second.transition, tolerance)

    if log.t.shape[0] < 2 or equations.count() < 2:
        return log.order_matters
    events = _Event(log.t, log.transition, log.before, log.mode_before, log.after, log.mode_after)
    first, second = (
        jax.tree.map(lambda column, part=part: column[part], events)
        for part in (slice(None, -1), slice(1, None))
    )
    pairs, no = jax.vmap(exchanged)(first, second), jnp.zeros(1, bool)
    return jnp.concatenate([pairs, no]) | jnp.concatenate([no, pairs])


def _was_due(equations: Equations, first: _Event, number: Array, tolerance: Scalar) -> Flag:
    """True if the event `number` was due at the time of another one, and not caused by its jump."""
    t, mode = first.t, first.mode_before
    place = t, first.before
    rate = equations.flow(*place, mode)
    before, falls = jax.jvp(
        lambda t, y: equations.guard_values(t, y, mode)[number], place, (jnp.ones_like(t), rate)
    )
    drop = before - equations.guard_values(t, first.after, first.mode_after)[number]
    return (falls < 0) & ((drop < before) | (before <= tolerance * drop))
