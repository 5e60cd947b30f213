"""The verb `simulate`: model → trajectory."""

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, PyTree

from impactjax._hybrid.arguments import (
    as_times,
    as_tolerance,
    check_order,
)
from impactjax._hybrid.chunks import CHUNK
from impactjax._hybrid.varying import alike
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._refusal import check_kind, whole
from impactjax._results import RESULTS
from impactjax._simulate.arguments import (
    as_factors,
    check_leaves,
    check_numbers,
    check_start,
    check_suits,
)
from impactjax._simulate.chatter import Chatter
from impactjax._simulate.default_step import natural_step
from impactjax._simulate.diagnosis import admitted
from impactjax._simulate.impact_log import Impacts, impacts_of
from impactjax._simulate.jumps import jumps_of
from impactjax._simulate.lane import Run
from impactjax._simulate.lane_state import LaneState, lane_state_at
from impactjax._simulate.loop import record_steps
from impactjax._simulate.replay import differentiable_path
from impactjax._simulate.rest_log import rests_of
from impactjax._simulate.sample import sample
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.trajectory import Stats, Trajectory
from impactjax._types import Factors, Flag, Numbers, Samples, Scalar

T = TypeVar("T")


def simulate(
    model: ImpactOscillator,
    initial: InitialState | LaneState,
    ts: Numbers,
    *,
    t0: ArrayLike | None = None,
    step: AbstractStep | None = None,
    tolerance: ArrayLike | None = None,
    max_steps: int = 1024,
    max_impacts: int = 64,
    chatter: Chatter = Chatter(),
    factors: Numbers | None = None,
) -> Trajectory:
    """Simulation of free flight and contact, with exact derivatives through every impact.

    Works under `jit`, `vmap`, `jvp` and `vjp`, in any combination. Parameter values never cause a
    retrace. A lane that fails has a code in `result` and does not affect the others.

    **Arguments:**

    - `model`: the oscillator and its stops.
    - `initial`: the state at `t0`; or `final` of an earlier run, which goes on as if there had been
      no cut, with derivatives across it.
    - `ts`: times at which to sample, strictly increasing, shape (samples,) [s].
    - `t0`: time of the initial state, not after the first sample [s]; by default that of the first
      sample.
    - `step`: integration method; by default a `TaylorStep` of the order that suits the tolerance if
      the model's equations are analytic, `RungeKutta()` otherwise.
    - `tolerance`: error allowed, relative to the motion; by default 1e-8 in double and 1e-5 in
      single precision. The order of the default step depends on it, and a new order is compiled
      anew.
    - `max_steps`: most steps of a lane. Memory grows with it, computing time hardly does.
    - `max_impacts`: rows of the impact log, of the rest log and of the jumps.
    - `chatter`: condition for summing an infinite series of impacts in closed form.
    - `factors`: factor on the speed at which the mass leaves the stop after each impact, in the
      order of the impacts, shape (impacts,) [1]: restitution that scatters. It is 1 for later
      impacts and for those of a summed chatter.

    **Raises** `TypeError` for an argument of another type, and `ValueError` for errors that are
    visible before the run: times that are not a strictly increasing list of numbers, a tolerance
    below the floating-point resolution, limits below one, a part of the model that is neither a
    number nor static. **Raises** `NotAnalytic` for a `TaylorStep` with equations that are not
    analytic. Other failures are in `result`.
    """
    return simulate_logged(
        model, initial, ts, t0, step, tolerance, max_steps, max_impacts, chatter, None, factors
    )


def simulate_logged(
    model: ImpactOscillator,
    initial: InitialState | LaneState,
    ts: Numbers,
    t0: ArrayLike | None,
    step: AbstractStep | None,
    tolerance: ArrayLike | None,
    max_steps: int,
    max_impacts: int,
    chatter: Chatter,
    logged: Flag | None,
    factors: Numbers | None,
) -> Trajectory:
    """Variant of `simulate`. The impact log is computed, without derivatives, if `logged` is true
    when the program runs; otherwise it is zero. Extremes are not looked for.
    """
    check_kind("model", model, ImpactOscillator, "ImpactOscillator(Pendulum(13.0))")
    check_kind("chatter", chatter, Chatter, "Chatter(below=1e-3)")
    if step is not None:
        check_kind("step", step, AbstractStep, "TaylorStep()")
    check_numbers(model)
    max_steps, max_impacts = whole("max_steps", max_steps), whole("max_impacts", max_impacts)
    times = as_times(ts)
    begin = check_start(model, initial, times, t0)
    check_order(begin, times)
    numbers = initial.point.y if isinstance(initial, LaneState) else initial
    check_leaves((model, numbers))
    dtype = jnp.result_type(float, *jax.tree.leaves((model, numbers)))
    allowed = as_tolerance(tolerance, dtype)
    method = natural_step(model, allowed) if step is None else step
    model = _cast(model, dtype)
    if isinstance(initial, LaneState):
        check_suits(initial, method, model)
    else:
        initial = _cast(initial, dtype)
    return _simulate(
        method,
        chatter,
        -(-max_steps // CHUNK) * CHUNK,
        max_impacts,
        model,
        initial,
        jnp.asarray(times, dtype),
        jnp.asarray(begin, dtype),
        jnp.asarray(allowed, dtype),
        logged,
        None if factors is None else as_factors(factors, dtype),
    )


@jax.jit(static_argnums=(0, 1, 2, 3), inline=True)  # so that a larger program sees its constants
def _simulate(
    step: AbstractStep,
    chatter: Chatter,
    max_steps: int,
    max_impacts: int,
    model: ImpactOscillator,
    initial: InitialState | LaneState,
    ts: Samples,
    t0: Scalar,
    tolerance: Scalar,
    logged: Flag | None,
    factors: Factors | None,
) -> Trajectory:
    start = initial if isinstance(initial, LaneState) else lane_state_at(step, model, t0, initial)
    in_order = jnp.all(jnp.diff(ts) > 0) & (start.point.t <= ts[0])
    run = Run(model, start, ts[-1], tolerance, in_order, factors)
    verdict = admitted(jax.lax.stop_gradient(run))
    runs = verdict == RESULTS.successful
    # The derivatives of a lane that cannot run must be finite, since they are multiplied by zero.
    model, y0, t0, times, factors = jax.tree.map(
        lambda leaf: jnp.where(runs, leaf, jnp.ones_like(leaf)),
        (model, start.point.y, start.point.t, ts, factors),
    )
    begin = dataclasses.replace(start, point=start.point._replace(t=t0, y=y0))
    run = jax.lax.stop_gradient(Run(model, begin, times[-1], tolerance, in_order, factors))
    record = record_steps(step, chatter, max_steps, run)
    path, final = differentiable_path(step, model, y0, t0, times[-1], factors, record)
    position, velocity = sample(step, model, path, record, times)
    tell = partial(impacts_of, step, max_impacts, logged is None)
    tell = tell if logged is None else _if_asked(logged, tell)
    impacts, total, found, magnified = tell(model, path, record, factors)
    rests, rests_total = rests_of(path, record.log, max_impacts)
    overflows = jnp.maximum(total, rests_total) > max_impacts
    full = RESULTS.where(overflows, RESULTS.max_impacts_reached, RESULTS.successful)
    ended = RESULTS.where(record.result == RESULTS.successful, full, record.result)
    known = runs & (start.point.t <= ts) & (ts <= record.t1)
    end = record.final.point._replace(t=final[0], y=final[1])
    return Trajectory(
        ts=ts,
        position=jnp.where(known, position, jnp.nan),
        velocity=jnp.where(known, velocity, jnp.nan),
        impacts=impacts,
        rests=rests,
        jumps=jumps_of(path, record.log, max_impacts),
        deepest_penetration=found.penetration,
        peak_force=found.force,
        nearest_miss=jnp.minimum(found.closest_turn, found.end),
        magnification=magnified,
        final=dataclasses.replace(record.final, point=end),
        result=RESULTS.where(runs, ended, verdict),
        stats=Stats(jnp.sum(record.log.taken, dtype=jnp.int32)),
    )


def _if_asked(logged: Flag, tell: Callable[..., Impacts]) -> Callable[..., Impacts]:
    """A function whose result is zero unless `logged`, without derivatives."""

    def told(*where: PyTree) -> Impacts:
        where = jax.lax.stop_gradient(where)
        shapes = jax.eval_shape(tell, *where)

        def nothing(*where: PyTree) -> Impacts:
            zeros = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
            return alike(zeros, where)

        return jax.lax.cond(logged, lambda *each: alike(tell(*each), each), nothing, *where)

    return told


def _cast(tree: T, dtype: np.dtype) -> T:
    def cast(leaf: PyTree) -> Array:
        array = jnp.asarray(leaf)
        return array if jnp.issubdtype(array.dtype, jnp.bool_) else array.astype(dtype)

    return jax.tree.map(cast, tree)
