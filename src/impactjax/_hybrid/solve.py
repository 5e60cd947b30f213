"""The verb `solve`: hybrid system and start → solution."""

from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float, PyTree

from impactjax._hybrid.equations import NO_EVENT, Equations, alike_in_shape
from impactjax._hybrid.event_log import events_of
from impactjax._hybrid.lane import Memory, Point, Record, Run, Start
from impactjax._hybrid.loop import record_steps
from impactjax._hybrid.path import Path, differentiable_path
from impactjax._hybrid.sampled import last_taken, sample
from impactjax._hybrid.solution import Solution
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import HybridSystem, State
from impactjax._refusal import check_kind
from impactjax._results import RESULTS
from impactjax._simulate.arguments import as_number, as_times, check_order, check_tolerance, limit
from impactjax._simulate.chunks import CHUNK
from impactjax._simulate.default_step import natural_order
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.taylor_step import TaylorStep
from impactjax._types import Numbers, Samples, Scalar

T = TypeVar("T")


def solve(
    system: HybridSystem,
    start: Start,
    ts: Numbers,
    *,
    tolerance: ArrayLike = 1e-8,
    scale: State | None = None,
    max_steps: int = 4096,
    max_events: int = 64,
    step: AbstractStep | None = None,
) -> Solution:
    """Solves a hybrid system through all its events.

    Differentiable of any order, in forward and reverse mode, with respect to the floating-point
    arrays of the system, the start and the times. Events have their own derivatives. Batches are
    made by `jax.vmap`: all lanes run in one loop, each with its own steps and events.

    **Arguments:**

    - `system`, `start`: the system, and where it starts.
    - `ts`: times of the samples, increasing, not before the start.
    - `tolerance`: relative error of a step, for each number of the state.
    - `scale`: a tree like the state, of sizes below which a number needs no accuracy; zero if left
      out. Give it for numbers that are zero up to rounding.
    - `max_steps`: number of attempts at a step in all lanes.
    - `max_events`: length of the event log.
    - `step`: a `TaylorStep` for flows that are analytic within each mode, or a `RungeKutta` for all
      others; by default a Taylor step of the order that costs least at this tolerance.

    **Raises** `ValueError` for a flow, jump or guard of the wrong shape, times out of order, and a
    flow that is not analytic with a Taylor step; `TypeError` for arguments of the wrong type.
    """
    check_kind("system", system, HybridSystem, "Ball(gravity, restitution)")
    check_kind("start", start, Start, "Start(t=0.0, y=y0)")
    if step is not None:
        check_kind("step", step, AbstractStep, "TaylorStep()")
    max_steps, max_events = limit("max_steps", max_steps), limit("max_events", max_events)
    times = as_times(ts)
    if start.memory is None:
        check_order(as_number("t", start.t), times)
    dtype = jnp.result_type(float, *jax.tree.leaves(start.y))
    allowed = as_number("tolerance", tolerance)
    check_tolerance(allowed, dtype)
    chosen = TaylorStep(natural_order(allowed)) if step is None else step
    return _solve(
        chosen.of_flows(),
        -(-max_steps // CHUNK) * CHUNK,
        max_events,
        system,
        _as_start(start, dtype),
        jnp.asarray(times, dtype),
        jnp.asarray(allowed, dtype),
        _as_scale(scale, start.y, dtype),
    )


def _as_start(start: Start, dtype: np.dtype) -> Start:
    y = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), start.y)
    if not jax.tree.leaves(y):
        raise ValueError("Argument `start` has a state without numbers.")
    mode = jax.tree.map(_as_mode, start.mode)
    return Start(jnp.asarray(start.t, dtype), y, mode, start.memory)


def _as_mode(leaf: ArrayLike) -> Array:
    array = jnp.asarray(leaf)
    if jnp.issubdtype(array.dtype, jnp.floating):
        raise TypeError(f"The mode of a start must be made of whole numbers, but it holds {leaf}.")
    return array if array.dtype == bool else array.astype(jnp.int32)


def _as_scale(scale: State | None, y: State, dtype: np.dtype) -> State:
    like = jax.tree.map(lambda leaf: jnp.zeros(jnp.shape(leaf), dtype), y)
    return like if scale is None else alike_in_shape("scale", scale, like)


@eqx.filter_jit
def _solve(
    step: AbstractFlowStep,
    max_steps: int,
    max_events: int,
    system: HybridSystem,
    start: Start,
    ts: Samples,
    tolerance: Scalar,
    scale: State,
) -> Solution:
    equations = Equations(system)
    point = _begin(step, equations, start)
    in_order = jnp.all(jnp.diff(ts) > 0) & (point.memory.since <= ts[0])
    floor = 10 * jnp.finfo(ts.dtype).eps
    verdict = RESULTS.where(tolerance >= floor, RESULTS.successful, RESULTS.tolerance_too_small)
    verdict = RESULTS.where(in_order, verdict, RESULTS.times_out_of_order)
    variable, fixed = eqx.partition(equations, eqx.is_array)
    run = jax.lax.stop_gradient(Run(variable, point, ts[-1], tolerance, scale, verdict))
    record = record_steps(step, fixed, max_steps, run)
    path = differentiable_path(step, fixed, variable, point.t, point.y, record)
    ys, modes = sample(step, equations, point, path, record, ts)
    events = events_of(equations, path, record, tolerance, max_events)
    final = _final(point, path, record)
    full = RESULTS.where(
        events.count > max_events, RESULTS.max_events_reached, RESULTS.successful
    )
    result = RESULTS.where(record.result == RESULTS.successful, full, record.result)
    reached = jnp.any(record.log.last) | (record.final.t > ts[-1])
    known = (ts <= record.final.t) | reached
    known = known & (verdict == RESULTS.successful)

    def where_known(column: Array) -> Array:
        return jnp.where(known.reshape(-1, *[1] * (column.ndim - 1)), column, jnp.nan)

    return Solution(
        ts,
        jax.tree.map(where_known, ys),
        modes,
        events,
        final,
        result,
        jnp.sum(record.log.taken, dtype=jnp.int32),
    )


def _begin(step: AbstractFlowStep, equations: Equations, start: Start) -> Point:
    """The first point, with what the lane remembers."""
    t, y, mode = start.t, start.y, start.mode
    if start.memory is not None:
        return Point(t, y, mode, start.memory)
    guards = equations.guard_values(t, y, mode)
    memory = Memory(
        guards >= 0,
        jnp.int32(NO_EVENT),
        jnp.zeros((), bool),
        jnp.int32(0),
        t,
        step.begin(equations, t, y, mode),
    )
    return Point(t, y, mode, jax.lax.stop_gradient(memory))


def _final(start: Point, path: Path, record: Record) -> Start:
    """Start of the next run, with derivatives."""
    row = last_taken(record)
    end = jax.tree.map(lambda column: column[row], (path.next_t, path.next_y))
    t, y = jax.tree.map(lambda new, old: jnp.where(row >= 0, new, old), end, (start.t, start.y))
    return Start(t, y, record.final.mode, record.final.memory)
