"""The flat adaptive loop: one attempt at a step of every lane in each pass.

It is never differentiated: see `replay.py`.
"""

from functools import partial
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array

from impactjax._hybrid.passes import in_one_loop, logged_passes
from impactjax._hybrid.varying import alike
from impactjax._results import RESULTS
from impactjax._simulate.automaton import NO_EVENT, Automaton, initial_mode
from impactjax._simulate.chatter import Chatter, Scale
from impactjax._simulate.diagnosis import admitted, concluded, diagnose, motion
from impactjax._simulate.disturbance import longest_step
from impactjax._simulate.lane import Lane, Log, Record, Run, factors_of
from impactjax._simulate.settling import is_settled
from impactjax._simulate.state import Phase
from impactjax._simulate.step import AbstractStep, Outcome, Point
from impactjax._simulate.transition import Context, Jump
from impactjax._types import Code, Flag

T = TypeVar("T")


def record_steps(step: AbstractStep, chatter: Chatter, max_steps: int, run: Run) -> Record:
    """Runs the lane and logs its steps. Under `vmap` all lanes run in one loop."""

    def loop(runs: Run) -> tuple[tuple[Log, Point, RESULTS], tuple[Array, Flag]]:
        runs = alike(runs, runs)
        begun = jax.vmap(lambda run: _begin(step, run))(runs)

        def one_pass(state: tuple[Lane, Flag]) -> tuple[tuple[Lane, Flag], Log]:
            lanes, row, chatter_now = _pass(step, chatter, runs, state[0])
            return (lanes, state[1] | chatter_now), row

        (lanes, chatters), log, passes = logged_passes(
            one_pass,
            lambda state: jnp.all(state[0].done),
            (begun, jnp.zeros((), bool)),
            jax.vmap(_row_without_step)(begun.point),
            max_steps,
            runs,
        )
        result = jax.vmap(concluded)(runs, lanes)
        return (log, lanes.point, result), (jnp.maximum(passes, 1), chatters)

    (log, end, result), (passes, chatters) = in_one_loop(loop, run)
    return Record(log, end, result, passes, chatters)


def _pass(step: AbstractStep, chatter: Chatter, runs: Run, lanes: Lane) -> tuple[Lane, Log, Flag]:
    """One attempt of every lane. Rare branches are skipped if no lane needs them."""
    outcomes = jax.vmap(lambda run, lane: _attempt(step, run, lane))(runs, lanes)
    outcomes = alike(outcomes, runs)
    chatters = jnp.any(lanes.point.mode.phase == Phase.CHATTER)
    if Automaton(runs.model).rigid_stops():
        outcomes = jax.lax.cond(
            chatters,
            lambda *each: alike(jax.vmap(_unless_chattering)(*each), runs),
            lambda *unchanged: unchanged[2],
            runs,
            lanes,
            outcomes,
        )
    if Automaton(runs.model).settling():
        slow = jnp.abs(outcomes.y.velocity) <= runs.tolerance * lanes.speed  # or it has not settled
        outcomes = jax.lax.cond(
            jnp.any(slow & (lanes.point.mode.phase == Phase.CONTACT)),
            lambda *each: alike(jax.vmap(_settled_or_not)(*each), runs),
            lambda *unchanged: unchanged[2],
            runs,
            lanes,
            outcomes,
        )
    arrivals = jax.lax.cond(
        jnp.any(outcomes.accepted & (outcomes.event != NO_EVENT)),
        lambda *each: alike(jax.vmap(partial(_arrive, chatter))(*each), runs),
        lambda *each: alike(jax.vmap(_stay)(*each), runs),
        runs,
        lanes,
        outcomes,
    )
    lanes, rows = jax.vmap(_proceed)(runs, lanes, outcomes, arrivals)
    return lanes, rows, chatters


def _begin(step: AbstractStep, run: Run) -> Lane:
    start, _ = initial_mode(run.model, run.t0, run.y0)
    span, result = run.t1 - run.t0, admitted(run)
    point = Point(run.t0, run.y0, start, jnp.int32(NO_EVENT))
    done = (result != RESULTS.successful) | ~(span > 0)
    zero = jnp.zeros_like(span)
    motion, speed = jnp.abs(run.y0.position), jnp.abs(run.y0.velocity)
    memory = step.begin(span)
    scale, impacts = Scale(zero, zero), jnp.int32(0)
    return Lane(point, run.t0, memory, scale, motion, speed, impacts, result, done)


def _attempt(step: AbstractStep, run: Run, lane: Lane) -> Outcome:
    automaton = Automaton(run.model)
    remaining = run.t1 - lane.point.t
    h = longest_step(automaton, lane.point, lane.begun, step, run.tolerance)
    longest = jnp.minimum(h, remaining)
    return step.attempt(automaton, lane.point, longest, run.tolerance, lane.memory)


def _unless_chattering(run: Run, lane: Lane, outcome: Outcome) -> Outcome:
    """The outcome, or the whole of a summed chatter as one step."""
    automaton, point = Automaton(run.model), lane.point
    remaining = run.t1 - point.t
    left = automaton.time_left(point.t, point.y, point.mode)
    chattering = point.mode.phase == Phase.CHATTER
    h = jnp.minimum(left, remaining)
    event = jnp.int32(NO_EVENT)
    for index, stop in automaton.rigid_stops():
        event = jnp.where(point.mode.stop == stop.wall.index, index, event).astype(jnp.int32)
    closed = Outcome(
        jnp.ones((), bool),
        h,
        automaton.with_chatter(point.t, point.y, point.mode, h, point.y),
        jnp.where(left <= remaining, event, NO_EVENT).astype(jnp.int32),
        outcome.memory,
    )
    return _choose(chattering, closed, outcome)


def _settled_or_not(run: Run, lane: Lane, outcome: Outcome) -> Outcome:
    """The outcome, with a transition to rest if the mass has settled in a compliant stop."""
    t, _, mode, _ = lane.point
    settles = outcome.accepted & (outcome.event == NO_EVENT)
    settles = settles & is_settled(
        run.model,
        t + outcome.h,
        outcome.y,
        mode,
        run.t0,
        run.tolerance,
        lane.motion,
        lane.speed,
    )
    (number,) = Automaton(run.model).settling()
    return outcome._replace(event=jnp.where(settles, jnp.int32(number), outcome.event))


class _Arrival(NamedTuple):
    """State and mode after a step and its jump."""

    jump: Jump
    scale: Scale
    impacts: Code


def _arrive(chatter: Chatter, run: Run, lane: Lane, outcome: Outcome) -> _Arrival:
    point = lane.point
    flies = point.mode.phase == Phase.FLIGHT
    speed = jnp.where(flies & (outcome.event != NO_EVENT), jnp.abs(outcome.y.velocity), 0)
    longest = jnp.maximum(lane.scale.longest, jnp.where(flies, outcome.h, 0))
    scale = Scale(jnp.maximum(lane.scale.fastest, speed), longest)
    context = Context(scale, run.tolerance, chatter)
    automaton, t = Automaton(run.model), point.t + outcome.h
    jump = automaton.jump(outcome.event, t, outcome.y, point.mode, context)
    if run.factors is None:
        return _Arrival(jump, scale, lane.impacts)
    where = outcome.event, t, outcome.y, point.mode
    impacts = lane.impacts + automaton.begins_impact(*where).astype(jnp.int32)
    state = automaton.scattered(*where, jump.state, factors_of(run.factors, impacts - 1))
    return _Arrival(jump._replace(state=state), scale, impacts)


def _stay(run: Run, lane: Lane, outcome: Outcome) -> _Arrival:
    del run
    return _Arrival(Jump(outcome.y, lane.point.mode, jnp.ones((), bool)), lane.scale, lane.impacts)


def _proceed(run: Run, lane: Lane, outcome: Outcome, arrival: _Arrival) -> tuple[Lane, Log]:
    point, (jump, scale, impacts) = lane.point, arrival
    last = outcome.accepted & (outcome.h >= run.t1 - point.t)
    t = jnp.where(last, run.t1, point.t + outcome.h)
    largest = jnp.maximum(lane.motion, motion(run, point, outcome))
    result = diagnose(run, point, outcome, jump.state, jump.in_range, largest)
    failed = result != RESULTS.successful
    moved = outcome.accepted & ~failed & ~lane.done
    after = Lane(
        _choose(moved, Point(t, jump.state, jump.mode, outcome.event), point),
        jnp.where(moved & (outcome.event != NO_EVENT), t, lane.begun),
        _choose(lane.done, lane.memory, outcome.memory),
        _choose(moved, scale, lane.scale),
        jnp.where(moved, largest, lane.motion),
        jnp.where(moved, jnp.maximum(lane.speed, jnp.abs(outcome.y.velocity)), lane.speed),
        jnp.where(moved, impacts, lane.impacts),
        RESULTS.where(lane.done, lane.result, result),
        lane.done | failed | (moved & last),
    )
    row = Log(point.t, point.y, point.mode, outcome.h, outcome.y, outcome.event, moved)
    return after, _choose(moved, row, _row_without_step(point))


def _row_without_step(point: Point) -> Log:
    nothing = jnp.zeros_like(point.t), point.y, jnp.int32(NO_EVENT), jnp.zeros((), bool)
    return Log(point.t, point.y, point.mode, *nothing)


def _choose(condition: Flag, yes: T, no: T) -> T:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)
