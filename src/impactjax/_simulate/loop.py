"""The flat adaptive loop: one attempt at a step of every lane in each pass.

It works on a batch of lanes itself, so that under `vmap` the pass counter stays a plain number and
the log is written a row a pass. It is never differentiated: see `replay.py`.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._results import RESULTS
from impactjax._simulate.automaton import NO_EVENT, Automaton, initial_mode
from impactjax._simulate.chatter import Chatter
from impactjax._simulate.chunks import CHUNK
from impactjax._simulate.flow import walls
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.step import AbstractStep, Outcome, Point
from impactjax._simulate.transition import Context, Jump
from impactjax._types import Flag, Scalar

T = TypeVar("T")
_Carry: TypeAlias = tuple["Lane", "Log", Array, Array]  # passes so far, and whether any chattered


class Run(eqx.Module):
    """What a lane is to do: go from the state `y0` at `t0` to `t1`."""

    model: ImpactOscillator
    y0: State
    t0: Scalar
    t1: Scalar
    tolerance: Scalar
    in_order: Flag  # whether the times asked for are


class Log(NamedTuple):
    """The steps of a lane, a row a pass."""

    t: Array  # start
    y: State  # at the start
    mode: Mode  # during the step
    h: Array  # duration; zero where the pass took no step
    end: State  # at the end, before any jump
    event: Array  # the transition at the end, or NO_EVENT
    taken: Array  # whether the pass took a step


class Lane(NamedTuple):
    """What a lane carries from pass to pass."""

    point: Point
    memory: PyTree
    fastest: Scalar  # approach speed so far, in units of the coordinate
    result: RESULTS
    done: Flag


class Record(NamedTuple):
    """All that the loop leaves behind."""

    log: Log
    end: Point
    result: RESULTS
    passes: Array  # of the whole batch: one plain number, whatever the number of lanes
    chatters: Array  # whether any lane of the batch has a summed chatter; likewise


def record_steps(step: AbstractStep, chatter: Chatter, max_steps: int, run: Run) -> Record:
    """Runs the lane and logs its steps. Under `vmap` all lanes run in one loop."""

    @jax.custom_batching.custom_vmap
    def record_batch(runs: Run) -> Record:
        return _loop(step, chatter, max_steps, runs)

    @record_batch.def_vmap
    def _(size: int, batched: list, runs: Run) -> tuple[Record, Record]:
        def merged(x: Array, is_batched: bool) -> Array:
            x = x if is_batched else jnp.broadcast_to(x, (size, *x.shape))
            return x.reshape(-1, *x.shape[2:])

        record = record_batch(jax.tree.map(merged, runs, batched[0]))
        split = _of_lanes(lambda x: x.reshape(size, -1, *x.shape[1:]), record)
        everywhere = jax.tree.map(lambda _: True, split)
        return split, everywhere._replace(passes=False, chatters=False)

    record = record_batch(jax.tree.map(lambda x: x[None], run))
    return _of_lanes(lambda x: x[0], record)


def _of_lanes(change: Callable[[Array], Array], record: Record) -> Record:
    """A record with what belongs to single lanes changed."""
    log, end, result = jax.tree.map(change, (record.log, record.end, record.result))
    return Record(log, end, result, record.passes, record.chatters)


def _loop(step: AbstractStep, chatter: Chatter, max_steps: int, runs: Run) -> Record:
    lanes = jax.vmap(lambda run: _begin(step, run))(runs)
    empty = jax.vmap(_row_without_step)(lanes.point)

    def rows(count: int) -> Log:
        return jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *x.shape)), empty)

    def unfinished(carry: _Carry) -> Flag:
        lanes, log, passes, _ = carry
        return (passes < log.h.shape[0]) & ~jnp.all(lanes.done)

    def one_pass(carry: _Carry) -> _Carry:
        lanes, log, passes, chatters = carry
        lanes, row, chatter_now = _pass(step, chatter, runs, lanes)
        log = jax.tree.map(lambda column, own: column.at[passes].set(own), log, row)
        return lanes, log, passes + 1, chatters | chatter_now

    def one_chunk(carry: _Carry) -> _Carry:
        """A chunk of passes with a short log of its own, which stays in the cache."""
        lanes, log, passes, chatters = carry
        begin = (lanes, rows(CHUNK), jnp.int32(0), chatters)
        lanes, chunk, more, chatters = jax.lax.while_loop(unfinished, one_pass, begin)
        log = jax.tree.map(
            lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, passes, 0),
            log,
            chunk,
        )
        return lanes, log, passes + more, chatters

    start = (lanes, rows(max_steps), jnp.int32(0), jnp.zeros((), bool))
    lanes, log, passes, chatters = jax.lax.while_loop(unfinished, one_chunk, start)
    result = jax.vmap(
        lambda lane: RESULTS.where(lane.done, lane.result, RESULTS.max_steps_reached)
    )(lanes)
    log = jax.tree.map(lambda x: jnp.moveaxis(x, 0, 1), log)
    return Record(log, lanes.point, result, passes, chatters)


def _pass(step: AbstractStep, chatter: Chatter, runs: Run, lanes: Lane) -> tuple[Lane, Log, Flag]:
    """One attempt of every lane; what only few lanes need is left out when none does."""
    outcomes = jax.vmap(lambda run, lane: _attempt(step, run, lane))(runs, lanes)
    chatters = jnp.any(lanes.point.mode.phase == Phase.CHATTER)
    if Automaton(runs.model).rigid_stops():
        outcomes = jax.lax.cond(
            chatters,
            jax.vmap(_unless_chattering),
            lambda *unchanged: unchanged[2],
            runs,
            lanes,
            outcomes,
        )
    arrivals = jax.lax.cond(
        jnp.any(outcomes.accepted & (outcomes.event != NO_EVENT)),
        jax.vmap(lambda run, lane, outcome: _arrive(chatter, run, lane, outcome)),
        jax.vmap(_stay),
        runs,
        lanes,
        outcomes,
    )
    lanes, rows = jax.vmap(_proceed)(runs, lanes, outcomes, arrivals)
    return lanes, rows, chatters


def _begin(step: AbstractStep, run: Run) -> Lane:
    start, inside = initial_mode(run.model, run.t0, run.y0)
    span = run.t1 - run.t0
    held = [jnp.ones((), bool), *(each.holds for each in run.model.requirements())]
    floor = 10 * jnp.finfo(span.dtype).eps
    result = RESULTS.where(inside, RESULTS.starts_inside_stop, RESULTS.successful)
    result = RESULTS.where(run.tolerance >= floor, result, RESULTS.tolerance_too_small)
    result = RESULTS.where(run.in_order, result, RESULTS.times_out_of_order)
    result = RESULTS.where(_all_finite((run.y0, span)), result, RESULTS.non_finite)
    result = RESULTS.where(jnp.all(jnp.stack(held)), result, RESULTS.impossible_parameters)
    point = Point(run.t0, run.y0, start, jnp.int32(NO_EVENT))
    done = (result != RESULTS.successful) | ~(span > 0)
    return Lane(point, step.begin(span), jnp.zeros_like(span), result, done)


def _attempt(step: AbstractStep, run: Run, lane: Lane) -> Outcome:
    automaton = Automaton(run.model)
    remaining = run.t1 - lane.point.t
    return step.attempt(automaton, lane.point, remaining, run.tolerance, lane.memory)


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


class _Arrival(NamedTuple):
    """Where a step leads to, jump included."""

    jump: Jump
    fastest: Scalar


def _arrive(chatter: Chatter, run: Run, lane: Lane, outcome: Outcome) -> _Arrival:
    point = lane.point
    flies = point.mode.phase == Phase.FLIGHT
    speed = jnp.where(flies & (outcome.event != NO_EVENT), jnp.abs(outcome.y.velocity), 0)
    fastest = jnp.maximum(lane.fastest, speed)
    context = Context(fastest, run.tolerance, chatter)
    jump = Automaton(run.model).jump(
        outcome.event, point.t + outcome.h, outcome.y, point.mode, context
    )
    return _Arrival(jump, fastest)


def _stay(run: Run, lane: Lane, outcome: Outcome) -> _Arrival:
    del run
    return _Arrival(Jump(outcome.y, lane.point.mode, jnp.ones((), bool)), lane.fastest)


def _proceed(run: Run, lane: Lane, outcome: Outcome, arrival: _Arrival) -> tuple[Lane, Log]:
    point, (jump, fastest) = lane.point, arrival
    last = outcome.accepted & (outcome.h >= run.t1 - point.t)
    t = jnp.where(last, run.t1, point.t + outcome.h)
    result = _diagnose(run, point, outcome, jump.state, jump.in_range)
    failed = result != RESULTS.successful
    moved = outcome.accepted & ~failed & ~lane.done
    after = Lane(
        _choose(moved, Point(t, jump.state, jump.mode, outcome.event), point),
        _choose(lane.done, lane.memory, outcome.memory),
        jnp.where(moved, fastest, lane.fastest),
        RESULTS.where(lane.done, lane.result, result),
        lane.done | failed | (moved & last),
    )
    row = Log(point.t, point.y, point.mode, outcome.h, outcome.y, outcome.event, moved)
    return after, _choose(moved, row, _row_without_step(point))


def _diagnose(run: Run, point: Point, outcome: Outcome, after: State, in_range: Flag) -> RESULTS:
    """Whether anything went wrong in a pass."""
    result = RESULTS.successful
    no_event = outcome.event == NO_EVENT
    stuck = (point.t + outcome.h == point.t) & (point.t < run.t1)
    stuck = stuck & jnp.where(outcome.accepted, no_event & (outcome.h > 0), True)
    result = RESULTS.where(stuck, RESULTS.step_too_small, result)
    motion = jnp.maximum(jnp.abs(after.position), jnp.abs(outcome.h * after.velocity))
    for wall in walls(run.model):
        through = wall.clearance(after.position) < -run.tolerance * motion
        free = (point.mode.phase == Phase.FLIGHT) & no_event & outcome.accepted
        result = RESULTS.where(through & free, RESULTS.stopped_through, result)
    asked = outcome.accepted & ~no_event
    result = RESULTS.where(asked & ~in_range, RESULTS.restitution_out_of_range, result)
    finite = _all_finite((outcome.h, outcome.y, after))
    return RESULTS.where(finite, result, RESULTS.non_finite)


def _row_without_step(point: Point) -> Log:
    nothing = jnp.zeros_like(point.t), point.y, jnp.int32(NO_EVENT), jnp.zeros((), bool)
    return Log(point.t, point.y, point.mode, *nothing)


def _choose(condition: Flag, yes: T, no: T) -> T:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def _all_finite(tree: PyTree) -> Flag:
    return jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in jax.tree.leaves(tree)]))
