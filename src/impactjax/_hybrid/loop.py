"""The adaptive loop: one attempt at a step of every lane in each pass.

It is never differentiated: see `path.py`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from impactjax._hybrid.equations import NO_EVENT, Equations, Jump, choose
from impactjax._hybrid.lane import Lane, Log, Memory, Point, Record, Run
from impactjax._hybrid.passes import in_one_loop, logged_passes
from impactjax._hybrid.step import AbstractFlowStep, Attempt
from impactjax._hybrid.varying import alike
from impactjax._results import RESULTS

_REPEATS = 8  # an event that repeats more often without time passing has no end
_UNMOVED = 16.0  # a jump leaves a guard at zero if the guard grows by less than this factor


def record_steps(step: AbstractFlowStep, fixed: Equations, max_steps: int, run: Run) -> Record:
    """Runs the lane and logs its steps. Under `vmap` all lanes run in one loop.

    `fixed` is all of the equations but their arrays.
    """

    def loop(runs: Run) -> tuple[tuple[Log, Point, RESULTS], Array]:
        runs = alike(runs, runs)
        begun = jax.vmap(_begin)(runs)
        lanes, log, passes = logged_passes(
            lambda lanes: jax.vmap(lambda run, lane: _pass(step, fixed, run, lane))(runs, lanes),
            lambda lanes: jnp.all(lanes.done),
            begun,
            jax.vmap(_row_without_step)(begun.point),
            max_steps,
            runs,
        )
        result = jax.vmap(_concluded)(lanes)
        return (log, lanes.point, result), jnp.maximum(passes, 1)

    (log, final, result), passes = in_one_loop(loop, run)
    return Record(log, final, result, passes)


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
    over = point.t >= run.t1  # what fails from there on is a matter of the next run
    result = RESULTS.where(over, RESULTS.successful, result)
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
        next_t=jnp.where(last, point.t, after.t),
        next_y=choose(last, point.y, after.y),
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
    return Log(t, y, mode, nothing, one, y, jnp.int32(NO_EVENT), no, t, y, mode, no, no)


def _concluded(lane: Lane) -> RESULTS:
    return RESULTS.where(lane.done, lane.result, RESULTS.max_steps_reached)
