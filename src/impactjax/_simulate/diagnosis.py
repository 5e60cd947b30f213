"""Result codes of a lane: checks before the run and after each pass."""

import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from impactjax._results import RESULTS
from impactjax._simulate.automaton import NO_EVENT, initial_mode
from impactjax._simulate.flow import free_acceleration, walls
from impactjax._simulate.lane import Run
from impactjax._simulate.state import Phase, State
from impactjax._simulate.step import Outcome, Point
from impactjax._types import Flag, Scalar


def admitted(run: Run) -> RESULTS:
    """`successful` if a lane can run, or the reason why it cannot."""
    t0, y0, *_ = run.start.point
    span = run.t1 - t0
    _, inside = initial_mode(run.model, t0, y0)
    held = [jnp.ones((), bool), *(each.holds for each in run.model.requirements())]
    if run.factors is not None:
        held.append(jnp.all(run.factors > 0))
    floor = 10 * jnp.finfo(span.dtype).eps
    result = RESULTS.where(inside, RESULTS.starts_inside_stop, RESULTS.successful)
    result = RESULTS.where(run.tolerance >= floor, result, RESULTS.tolerance_too_small)
    result = RESULTS.where(run.in_order, result, RESULTS.times_out_of_order)
    result = RESULTS.where(_all_finite((y0, span)), result, RESULTS.non_finite)
    return RESULTS.where(jnp.all(jnp.stack(held)), result, RESULTS.impossible_parameters)


def motion(run: Run, point: Point, outcome: Outcome) -> Scalar:
    """Scale of the motion in a step: the larger of the distance of its end from zero and the way
    covered; at rest, the way of a free mass.
    """
    t, y, _, _ = point
    way = outcome.h**2 * free_acceleration(run.model, t, y)
    position, velocity, _ = outcome.y
    return jnp.max(jnp.abs(jnp.stack([position, outcome.h * velocity, way])))


def diagnose(
    run: Run, point: Point, outcome: Outcome, after: State, in_range: Flag, motion: Scalar
) -> RESULTS:
    """`successful`, or the failure that a pass shows."""
    result = RESULTS.successful
    no_event = outcome.event == NO_EVENT
    stuck = (point.t + outcome.h == point.t) & (point.t < run.t1)
    stuck = stuck & jnp.where(outcome.accepted, no_event & (outcome.h > 0), True)
    result = RESULTS.where(stuck, RESULTS.step_too_small, result)
    for wall in walls(run.model):
        through = wall.clearance(after.position) < -run.tolerance * motion
        free = (point.mode.phase == Phase.FLIGHT) & no_event & outcome.accepted
        result = RESULTS.where(through & free, RESULTS.stopped_through, result)
    asked = outcome.accepted & ~no_event
    finite = _all_finite((outcome.h, outcome.y, after))
    result = RESULTS.where(finite, result, RESULTS.non_finite)
    return RESULTS.where(asked & ~in_range, RESULTS.restitution_out_of_range, result)


def concluded(run: Run, motion: Scalar, speed: Scalar) -> RESULTS:
    """`successful`, or a warning, of a lane that has reached the end of its run."""
    latest = jnp.maximum(jnp.abs(run.start.point.t), jnp.abs(run.t1))
    coarse = jnp.finfo(latest.dtype).eps * latest * speed > run.tolerance * motion
    return RESULTS.where(coarse, RESULTS.time_too_coarse, RESULTS.successful)


def _all_finite(tree: PyTree) -> Flag:
    return jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in jax.tree.leaves(tree)]))
