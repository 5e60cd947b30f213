"""The adaptive loop: one attempt at a step of every lane in each pass.

It handles the batch of lanes itself, so that under `vmap` the pass counter is not batched, and each
pass writes one row of the log. It is never differentiated: see `path.py`.
"""

from collections.abc import Callable
from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from impactjax._hybrid.chunks import CHUNK
from impactjax._hybrid.equations import NO_EVENT, Equations, Jump, choose
from impactjax._hybrid.lane import Lane, Log, Memory, Point, Record, Run
from impactjax._hybrid.step import AbstractFlowStep, Attempt
from impactjax._hybrid.varying import alike
from impactjax._results import RESULTS
from impactjax._types import Flag

_REPEATS = 8  # an event that repeats more often without time passing has no end
_UNMOVED = 16.0  # a jump leaves a guard at zero if the guard grows by less than this factor

_Carry: TypeAlias = tuple[Lane, Log, Array]


def record_steps(step: AbstractFlowStep, fixed: Equations, max_steps: int, run: Run) -> Record:
    """Runs the lane and logs its steps. Under `vmap` all lanes run in one loop.

    `fixed` is all of the equations but their arrays.
    """

    @jax.custom_batching.custom_vmap
    def record_batch(runs: Run) -> Record:
        return _loop(step, fixed, max_steps, runs)

    @record_batch.def_vmap
    def _(size: int, batched: list[PyTree], runs: Run) -> tuple[Record, Record]:
        def merged(x: Array, is_batched: bool) -> Array:
            x = x if is_batched else jnp.broadcast_to(x, (size, *x.shape))
            return x.reshape(-1, *x.shape[2:])

        record = record_batch(jax.tree.map(merged, runs, batched[0]))
        split = _of_lanes(lambda x: x.reshape(size, -1, *x.shape[1:]), record)
        return split, jax.tree.map(lambda _: True, split)._replace(passes=False)

    record = record_batch(jax.tree.map(lambda x: x[None], run))
    return _of_lanes(lambda x: x[0], record)


def _of_lanes(change: Callable[[Array], Array], record: Record) -> Record:
    """A record with a change of the arrays that have an axis of lanes."""
    log, final, result = jax.tree.map(change, (record.log, record.final, record.result))
    return Record(log, final, result, record.passes)


def _loop(step: AbstractFlowStep, fixed: Equations, max_steps: int, runs: Run) -> Record:
    runs = alike(runs, runs)
    lanes = jax.vmap(_begin)(runs)
    empty = jax.vmap(_row_without_step)(lanes.point)

    def rows(count: int) -> Log:
        return jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *x.shape)), empty)

    def unfinished(carry: _Carry) -> Flag:
        lanes, log, passes = carry
        return (passes < log.h.shape[0]) & ~jnp.all(lanes.done)

    def one_pass(carry: _Carry) -> _Carry:
        lanes, log, passes = carry
        lanes, row = jax.vmap(lambda run, lane: _pass(step, fixed, run, lane))(runs, lanes)
        log = jax.tree.map(lambda column, own: column.at[passes].set(own), log, row)
        return alike((lanes, log, passes + 1), runs)

    def one_chunk(carry: _Carry) -> _Carry:
        """A chunk of passes with its own short log, which stays in the processor's cache."""
        lanes, log, passes = carry
        begin = alike((lanes, rows(CHUNK), jnp.int32(0)), runs)
        lanes, chunk, more = jax.lax.while_loop(unfinished, one_pass, begin)
        log = jax.tree.map(
            lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, passes, 0),
            log,
            chunk,
        )
        return lanes, log, passes + more

    start = alike((lanes, rows(max_steps), jnp.int32(0)), runs)
    lanes, log, passes = jax.lax.while_loop(unfinished, one_chunk, start)
    result = jax.vmap(_concluded)(lanes)
    log = jax.tree.map(lambda x: jnp.moveaxis(x, 0, 1), log)
    return Record(log, lanes.point, result, jnp.maximum(passes, 1))


def _begin(run: Run) -> Lane:
    done = (run.verdict != RESULTS.successful) | (run.start.t > run.t1)
    return Lane(run.start, jnp.int32(0), run.verdict, done | run.start.memory.ended)


def _pass(step: AbstractFlowStep, fixed: Equations, run: Run, lane: Lane) -> tuple[Lane, Log]:
    point, equations = lane.point, eqx.combine(run.arrays, fixed)
    attempt = step.attempt(equations, point, run.tolerance, run.scale)
    t = point.t + attempt.h
    last = attempt.accepted & (t > run.t1)
    event = jnp.where(last, NO_EVENT, attempt.event)
    jump = equations.jump(event, t, attempt.y, point.mode)
    after = _arrived(equations, point, attempt, jump)
    result = _diagnosed(point, attempt, after)
    failed = result != RESULTS.successful
    taken = attempt.accepted & ~failed & ~lane.done
    moved = taken & ~last
    retried = point._replace(memory=point.memory._replace(step=attempt.memory))
    still = choose(lane.done | attempt.accepted, point, retried)
    row = Log(
        t=point.t,
        y=point.y,
        mode=point.mode,
        h=attempt.h,
        unit=attempt.unit,
        end=attempt.y,
        event=event,
        caused=attempt.caused,
        next_mode=jump.mode,
        taken=taken,
        last=last,
    )
    marks = lane.marks + (moved & (event != NO_EVENT) & (event == run.mark)).astype(jnp.int32)
    full = moved & (marks >= run.marks)
    lane = Lane(
        choose(moved, after, still),
        marks,
        RESULTS.where(lane.done, lane.result, result),
        lane.done | failed | full | (taken & (last | jump.ends)) | (moved & (after.t > run.t1)),
    )
    return lane, choose(taken, row, _row_without_step(point))


def _arrived(equations: Equations, point: Point, attempt: Attempt, jump: Jump) -> Point:
    """The start of the next step."""
    t = point.t + attempt.h
    before, event = point.memory, attempt.event
    happens = event != NO_EVENT
    again = happens & (event == before.arrival) & (t == point.t)
    arrival = jnp.where(happens | (attempt.h > 0), event, before.arrival)
    stays = before.stays & (arrival == before.arrival) & (attempt.h == 0)
    if equations.count():
        guards = equations.guard_values(t, attempt.y, point.mode)
        later = equations.guard_values(t + jump.wait, jump.y, jump.mode)
        unmoved = jnp.abs(later) <= _UNMOVED * jnp.abs(guards)
        stays = jnp.where(happens, unmoved[event], stays)
    memory = Memory(
        attempt.armed,
        arrival,
        stays,
        jnp.where(again, before.repeats + 1, 0).astype(jnp.int32),
        t,
        jump.ends,
        attempt.memory,
    )
    return Point(t + jump.wait, jump.y, jump.mode, memory)


def _diagnosed(point: Point, attempt: Attempt, after: Point) -> RESULTS:
    """`successful`, or the failure that a pass shows."""
    result = RESULTS.successful
    idle = attempt.event == NO_EVENT
    idle = idle & jnp.all(attempt.armed == point.memory.armed) & (attempt.h > 0)
    stuck = (point.t + attempt.h == point.t) & jnp.where(attempt.accepted, idle, True)
    result = RESULTS.where(stuck, RESULTS.step_too_small, result)
    endless = attempt.accepted & (after.memory.repeats > _REPEATS)
    endless = endless | (stuck & (point.memory.arrival != NO_EVENT))
    result = RESULTS.where(endless, RESULTS.event_repeats, result)
    parts = jax.tree.leaves((attempt.h, attempt.y, after.t, after.y))
    finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(part)) for part in parts]))
    return RESULTS.where(finite, result, RESULTS.non_finite)


def _row_without_step(point: Point) -> Log:
    t, y, mode, _ = point
    nothing, one, no = jnp.zeros_like(t), jnp.ones_like(t), jnp.zeros((), bool)
    return Log(t, y, mode, nothing, one, y, jnp.int32(NO_EVENT), no, mode, no, no)


def _concluded(lane: Lane) -> RESULTS:
    return RESULTS.where(lane.done, lane.result, RESULTS.max_steps_reached)
