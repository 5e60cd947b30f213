"""The verb `solve`: hybrid system and start → solution."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

from impactjax._hybrid.arguments import as_number, as_times, as_tolerance, check_order
from impactjax._hybrid.chunks import CHUNK
from impactjax._hybrid.ends import as_scale, as_start, begin, final_of, flow_step, with_arrays
from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.event_log import events_of
from impactjax._hybrid.lane import Run, Start
from impactjax._hybrid.loop import record_steps
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.path import differentiable_path
from impactjax._hybrid.sampled import sample
from impactjax._hybrid.solution import Solution
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import HybridSystem, State
from impactjax._known import AnyArray
from impactjax._refusal import check_kind, whole
from impactjax._results import RESULTS
from impactjax._types import Numbers, Samples, Scalar


def solve(
    system: HybridSystem,
    start: Start,
    ts: Numbers,
    *,
    tolerance: ArrayLike | None = None,
    scale: State | None = None,
    max_steps: int = 4096,
    max_events: int = 64,
    step: AbstractMethod | None = None,
) -> Solution:
    """Solves a hybrid system through all its events.

    Differentiable of any order, in forward and reverse mode, with respect to the floating-point
    arrays of the system, the start and the times. Events have their own derivatives. Batches are
    made by `jax.vmap`: all lanes run in one loop, each with its own steps and events.

    **Arguments:**

    - `system`, `start`: the system, and where it starts.
    - `ts`: times of the samples, increasing, not before the start.
    - `tolerance`: relative error of a step, for each number of the state; by default 1e-8, in
      single precision 1e-5.
    - `scale`: a tree like the state, of sizes below which a number needs no accuracy; zero if left
      out. Give it for numbers that are zero up to rounding.
    - `max_steps`: number of attempts at a step in all lanes.
    - `max_events`: length of the event log.
    - `step`: a `TaylorStep` for flows that are analytic within each mode, or a `RungeKutta` for all
      others. By default, a Taylor step of the order that costs least at this tolerance if flow and
      guards are analytic and have at most 150 operations; otherwise a Runge-Kutta step of order 8.

    **Raises** `ValueError` for a flow, jump or guard of the wrong shape, times out of order, and a
    flow that is not analytic with a Taylor step; `TypeError` for arguments of the wrong type.
    """
    check_kind("system", system, HybridSystem, "Ball(gravity, restitution)")
    check_kind("start", start, Start, "Start(t=0.0, y=y0)")
    times = as_times(ts)
    if start.memory is None:
        check_order(as_number("t", start.t), times)
    return solve_run(
        system,
        start,
        times,
        tolerance=tolerance,
        scale=scale,
        max_steps=max_steps,
        max_events=max_events,
        method=step,
    )


def solve_run(
    system: HybridSystem,
    start: Start,
    ts: AnyArray,
    *,
    tolerance: ArrayLike | None,
    scale: State | None,
    max_steps: int,
    max_events: int,
    method: AbstractMethod | None,
) -> Solution:
    """`solve` for times of which some may be equal."""
    rows, max_events = whole("max_steps", max_steps), whole("max_events", max_events)
    dtype = jnp.result_type(float, *jax.tree.leaves(start.y))
    allowed = as_tolerance(tolerance, dtype)
    begun, system = as_start(start, dtype), with_arrays(system, dtype)
    return _solve(
        flow_step(method, Equations(system), begun, allowed),
        -(-rows // CHUNK) * CHUNK,
        max_events,
        system,
        begun,
        jnp.asarray(ts, dtype),
        jnp.asarray(allowed, dtype),
        as_scale(scale, start.y, dtype),
    )


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
    point = begin(step, equations, start)
    in_order = jnp.all(jnp.diff(ts) >= 0) & (point.memory.since <= ts[0])
    floor = 10 * jnp.finfo(ts.dtype).eps
    verdict = RESULTS.where(tolerance >= floor, RESULTS.successful, RESULTS.tolerance_too_small)
    verdict = RESULTS.where(in_order, verdict, RESULTS.times_out_of_order)
    variable, fixed = eqx.partition(equations, eqx.is_array)
    none, never = jnp.int32(NO_EVENT), jnp.int32(jnp.iinfo(jnp.int32).max)
    run = Run(variable, point, ts[-1], tolerance, scale, none, never, verdict)
    run = jax.lax.stop_gradient(run)
    record = record_steps(step, fixed, max_steps, run)
    path = differentiable_path(step, fixed, variable, point.t, point.y, record)
    ys, modes = sample(step, equations, point, path, record, ts)
    events = events_of(equations, path, record, tolerance, max_events)
    final = final_of(point, path, record)
    full = RESULTS.where(events.count > max_events, RESULTS.max_events_reached, RESULTS.successful)
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
