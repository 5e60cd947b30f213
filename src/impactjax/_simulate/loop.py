"""The flat adaptive loop: one attempt at a step of every lane in each pass.

It is never differentiated: see `replay.py`.
"""

import dataclasses
from functools import partial
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array

from impactjax._hybrid.passes import in_one_loop, logged_passes
from impactjax._hybrid.varying import alike
from impactjax._results import RESULTS
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.chatter import Chatter, Scale
from impactjax._simulate.diagnosis import admitted, concluded, diagnose, motion
from impactjax._simulate.disturbance import longest_step
from impactjax._simulate.lane import Lane, Log, Record, Run, Whole, cut, factors_of
from impactjax._simulate.lane_state import LaneState
from impactjax._simulate.settling import is_settled
from impactjax._simulate.state import Phase
from impactjax._simulate.step import AbstractStep, Outcome, Point
from impactjax._simulate.transition import Context, Jump
from impactjax._types import Code, Flag

T = TypeVar("T")


def record_steps(step: AbstractStep, chatter: Chatter, max_steps: int, run: Run) -> Record:
    """Runs the lane and logs its steps. Under `vmap` all lanes run in one loop."""

    def loop(runs: Run) -> tuple[tuple[Log, Lane], tuple[Array, Flag]]:
        runs = alike(runs, runs)
        begun = jax.vmap(_begin)(runs)

        def one_pass(state: tuple[Lane, Flag]) -> tuple[tuple[Lane, Flag], Log]:
            lanes, row, chatter_now = _pass(step, chatter, runs, state[0])
            return (lanes, state[1] | chatter_now), row

        (lanes, chatters), log, passes = logged_passes(
            one_pass,
            lambda state: jnp.all(state[0].done),
            (begun, jnp.zeros((), bool)),
            jax.vmap(lambda lane: _row_without_step(lane.state.point))(begun),
            max_steps,
            runs,
        )
        return (log, lanes), (jnp.maximum(passes, 1), chatters)

    (log, lane), (passes, chatters) = in_one_loop(loop, run)
    reached = jnp.any(log.taken & (log.t + log.h >= run.t1))
    t1 = jnp.where(reached, run.t1, lane.state.point.t)
    result = RESULTS.where(lane.done, lane.result, RESULTS.max_steps_reached)
    whole = Whole(log.h, log.event)
    return Record(cut(log, run.t1), whole, lane.state, t1, result, passes, chatters)


def _pass(step: AbstractStep, chatter: Chatter, runs: Run, lanes: Lane) -> tuple[Lane, Log, Flag]:
    """One attempt of every lane. Rare branches are skipped if no lane needs them."""
    outcomes = jax.vmap(lambda run, lane: _attempt(step, run, lane))(runs, lanes)
    outcomes = alike(outcomes, runs)
    phase = lanes.state.point.mode.phase
    chatters = jnp.any(phase == Phase.CHATTER)
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
        speed = lanes.state.speed
        slow = jnp.abs(outcomes.y.velocity) <= runs.tolerance * speed  # or it has not settled
        outcomes = jax.lax.cond(
            jnp.any(slow & (phase == Phase.CONTACT)),
            lambda *each: alike(jax.vmap(_settled_or_not)(*each), runs),
            lambda *unchanged: unchanged[2],
            runs,
            lanes,
            outcomes,
        )
    arrivals = jax.lax.cond(
        jnp.any(jax.vmap(_ends_on_event)(runs, lanes, outcomes)),
        lambda *each: alike(jax.vmap(partial(_arrive, chatter))(*each), runs),
        lambda *each: alike(jax.vmap(_stay)(*each), runs),
        runs,
        lanes,
        outcomes,
    )
    lanes, rows = jax.vmap(_proceed)(runs, lanes, outcomes, arrivals)
    return lanes, rows, chatters


def _begin(run: Run) -> Lane:
    result = admitted(run)
    done = (result != RESULTS.successful) | ~(run.t1 > run.start.point.t)
    return Lane(run.start, jnp.int32(0), result, done)


def _attempt(step: AbstractStep, run: Run, lane: Lane) -> Outcome:
    automaton, state = Automaton(run.model), lane.state
    longest = longest_step(automaton, state.point, state.begun, step, run.tolerance)
    until = run.model.oscillator.smooth_until(state.point.t)
    if until is not None:
        longest = jnp.minimum(longest, until - state.point.t)
    return step.attempt(automaton, state.point, longest, run.tolerance, state.memory)


def _unless_chattering(run: Run, lane: Lane, outcome: Outcome) -> Outcome:
    """The outcome, or the whole of a summed chatter as one step."""
    automaton, point = Automaton(run.model), lane.state.point
    left = automaton.time_left(point.t, point.y, point.mode)
    chattering = point.mode.phase == Phase.CHATTER
    event = jnp.int32(NO_EVENT)
    for index, stop in automaton.rigid_stops():
        event = jnp.where(point.mode.stop == stop.wall.index, index, event).astype(jnp.int32)
    end = automaton.with_chatter(point.t, point.y, point.mode, left, point.y)
    closed = Outcome(jnp.ones((), bool), left, end, event, outcome.memory)
    return _choose(chattering, closed, outcome)


def _settled_or_not(run: Run, lane: Lane, outcome: Outcome) -> Outcome:
    """The outcome, with a transition to rest if the mass has settled in a compliant stop."""
    t, _, mode, _ = lane.state.point
    settles = outcome.accepted & (outcome.event == NO_EVENT)
    settles = settles & is_settled(
        run.model,
        t + outcome.h,
        outcome.y,
        mode,
        lane.state.origin,
        run.tolerance,
        lane.state.motion,
        lane.state.speed,
    )
    (number,) = Automaton(run.model).settling()
    return outcome._replace(event=jnp.where(settles, jnp.int32(number), outcome.event))


def _goes_beyond(run: Run, lane: Lane, outcome: Outcome) -> Flag:
    """True for a step that ends after the run."""
    return outcome.h > run.t1 - lane.state.point.t


def _ends_on_event(run: Run, lane: Lane, outcome: Outcome) -> Flag:
    """True for a step that ends on an event of the run."""
    happens = outcome.accepted & (outcome.event != NO_EVENT)
    return happens & ~_goes_beyond(run, lane, outcome)


class _Arrival(NamedTuple):
    """State and mode after a step and its jump."""

    jump: Jump
    scale: Scale
    impacts: Code


def _arrive(chatter: Chatter, run: Run, lane: Lane, outcome: Outcome) -> _Arrival:
    point, before = lane.state.point, lane.state.scale
    flies = (point.mode.phase == Phase.FLIGHT) & (outcome.event != NO_EVENT)
    fastest = jnp.maximum(before.fastest, jnp.where(flies, jnp.abs(outcome.y.velocity), 0))
    scale = Scale(fastest, jnp.maximum(before.longest, jnp.where(flies, outcome.h, 0)))
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
    jump = Jump(outcome.y, lane.state.point.mode, jnp.ones((), bool))
    return _Arrival(jump, lane.state.scale, lane.impacts)


def _proceed(run: Run, lane: Lane, outcome: Outcome, arrival: _Arrival) -> tuple[Lane, Log]:
    before, (jump, scale, impacts) = lane.state, arrival
    point, t = before.point, before.point.t + outcome.h
    last = outcome.accepted & _goes_beyond(run, lane, outcome)
    largest = jnp.maximum(before.motion, motion(run, point, outcome))
    fastest = jnp.maximum(before.speed, jnp.abs(outcome.y.velocity))
    state = _choose(last, outcome.y, jump.state)
    result = diagnose(run, point, outcome, state, last | jump.in_range, largest)
    failed = result != RESULTS.successful
    taken = outcome.accepted & ~failed & ~lane.done
    moved, ends = taken & ~last, taken & (last | (t >= run.t1))
    result = RESULTS.where(ends, concluded(run, largest, fastest), result)
    after = LaneState(
        Point(t, state, jump.mode, outcome.event),
        before.origin,
        jnp.where(outcome.event != NO_EVENT, t, before.begun),
        scale,
        largest,
        fastest,
        outcome.memory,
        before.kind,
    )
    retried = dataclasses.replace(before, memory=outcome.memory)
    still = _choose(lane.done | outcome.accepted, before, retried)
    row = Log(point.t, point.y, point.mode, outcome.h, outcome.y, outcome.event, taken)
    lane = Lane(
        _choose(moved, after, still),
        jnp.where(moved, impacts, lane.impacts),
        RESULTS.where(lane.done, lane.result, result),
        lane.done | failed | ends,
    )
    return lane, _choose(taken, row, _row_without_step(point))


def _row_without_step(point: Point) -> Log:
    nothing = jnp.zeros_like(point.t), point.y, jnp.int32(NO_EVENT), jnp.zeros((), bool)
    return Log(point.t, point.y, point.mode, *nothing)


def _choose(condition: Flag, yes: T, no: T) -> T:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)
