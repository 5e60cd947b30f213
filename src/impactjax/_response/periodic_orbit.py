"""The verb `periodic_orbit`: hybrid system and start → orbit."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

from impactjax._hybrid.arguments import as_tolerance
from impactjax._hybrid.ends import as_scale, as_start, flow_step, with_arrays
from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.event_log import EventLog
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.numbers import packed
from impactjax._hybrid.solution import Solution
from impactjax._hybrid.solve import solve
from impactjax._hybrid.system import HybridSystem, State
from impactjax._refusal import check_kind, whole
from impactjax._response.equations import Arcs, Family, Itinerary
from impactjax._response.linear import Cycle, linearised
from impactjax._response.newton import fixed_parameter, sizes_of, solved
from impactjax._response.orbit import Orbit, orbit_of
from impactjax._response.period import Period, as_function
from impactjax._response.segment import Free
from impactjax._results import RESULTS

_TOLERANCE = 1e-12
_SAME_TIME = 8.0  # units in the last place
_SAME_RATE = 1e-6  # relative difference of rates that are the same
_SHARES = (0.0, 0.37)  # of a period, at which rates are compared


def periodic_orbit(
    system: HybridSystem,
    start: Start,
    period: Period,
    *,
    multiple: int = 1,
    settle: int = 0,
    tolerance: ArrayLike = _TOLERANCE,
    scale: State | None = None,
    max_steps: int = 4096,
    max_events: int = 64,
    step: AbstractMethod | None = None,
) -> Orbit:
    """Finds a periodic orbit of a forced hybrid system near a motion.

    The events of the motion in one period are recorded; they are the itinerary of the orbit. States
    just after these events, and times between them, are then found by multiple shooting: Newton's
    method on all of them at once, with exact derivatives through the events. An unstable orbit is
    found as well as a stable one. The system must depend on time with the period of the force.

    **Arguments:**

    - `system`, `start`: the system, and where the motion starts.
    - `period`: period of the force: a number, or a function of the system.
    - `multiple`: number of periods of the force in a period of the orbit.
    - `settle`: number of periods of the orbit that the motion is followed before its events are
      recorded.
    - `tolerance`, `scale`, `step`: as for `solve`.
    - `max_steps`: largest number of steps in a period, and between two events.
    - `max_events`: largest number of events in a period.

    **Raises** `ValueError` in single precision, for a period that is not positive or not that of
    the system, for a motion
    that cannot be followed, and as `solve` does; `TypeError` for arguments of the wrong type.
    """
    check_kind("system", system, HybridSystem, "Ball(gravity, restitution)")
    check_kind("start", start, Start, "Start(t=0.0, y=y0)")
    multiple, settle = whole("multiple", multiple), whole("settle", settle, least=0)
    max_steps, max_events = whole("max_steps", max_steps), whole("max_events", max_events)
    dtype = jnp.result_type(float, *jax.tree.leaves(start.y))
    if jnp.finfo(dtype).bits < 64:
        raise ValueError("Periodic orbits need double precision: set `jax_enable_x64`.")
    allowed, own = as_tolerance(tolerance, dtype), _typed(with_arrays(system, dtype))
    force = as_function(period, own)
    duration = multiple * jnp.asarray(force(own), dtype)
    begun = as_start(Start(start.t, start.y, start.mode), dtype)
    _check_repeats(own, begun, duration / multiple)

    def followed(start: Start) -> Solution:
        run = solve(
            own,
            start,
            (start.t + duration)[None],
            tolerance=allowed,
            scale=scale,
            max_steps=max_steps,
            max_events=max_events,
            step=step,
        )
        if run.result != RESULTS.successful:
            raise ValueError(f"The motion cannot be followed for a period: {RESULTS[run.result]}")
        return run

    for _ in range(settle):
        run = followed(begun)
        y, mode = jax.tree.map(lambda column: column[-1], (run.ys, run.modes))
        begun = Start(begun.t, y, mode)  # the force repeats, and small times are exact
    itinerary, arcs = _recorded(followed(begun).events, begun, float(duration))
    family = Family(
        flow_step(step, Equations(Free(own)), begun, allowed),
        own,
        jax.tree.map(jnp.zeros_like, eqx.filter(own, eqx.is_inexact_array)),
        force,
        jax.device_get(begun.y),
        as_scale(scale, begun.y, dtype),
        jnp.asarray(allowed, dtype),
        max_steps,
    )
    cycle = Cycle(family, itinerary, multiple, float(jnp.asarray(begun.t)))
    linear = linearised(cycle, cycle.packed(arcs, 0.0))
    sizes = sizes_of(linear, 1.0)
    found = solved(linear, sizes, fixed_parameter(linear.unknowns, sizes))
    return orbit_of(found.linear, sizes, found.converged)


def _check_repeats(system: HybridSystem, start: Start, period: Array) -> None:
    """Raises `ValueError` if the rates at the start are not the same a period later."""
    for share in _SHARES:
        t = jnp.asarray(start.t + share * period)
        now, later = _rates(system, start, t), _rates(system, start, t + period)
        if not np.all(np.abs(later - now) <= _SAME_RATE * np.max(np.abs(now), initial=1e-300)):
            raise ValueError(
                f"Argument `period` is not that of the system: rates change within {period}."
            )


@eqx.filter_jit
def _rates(system: HybridSystem, start: Start, t: Array) -> Array:
    """Rates of a system at the state of a start, at any time."""
    return packed(system.flow(t, start.y, start.mode))


def _typed(system: HybridSystem) -> HybridSystem:
    """A system whose arrays have types of their own, since weak types would cause a retrace."""
    return jax.tree.map(
        lambda leaf: jnp.asarray(leaf, leaf.dtype) if eqx.is_array(leaf) else leaf, system
    )


def _recorded(events: EventLog, start: Start, period: float) -> tuple[Itinerary, Arcs]:
    """Itinerary and segments of a motion over a period, each segment from just after an event."""
    log = jax.device_get(events)
    count = int(log.count)
    if not count:
        mode = jax.tree.map(lambda leaf: np.asarray(leaf)[None], start.mode)
        row = np.asarray(packed(start.y))[None]
        t, d = np.asarray(start.t)[None], np.array([period])
        return Itinerary(np.full(1, NO_EVENT, np.int32), np.zeros(1, bool), mode), Arcs(t, row, d)
    rows = np.arange(count)
    t, until, event, after, mode = jax.tree.map(
        lambda column: column[rows], (log.t, log.until, log.transition, log.after, log.mode_after)
    )
    d = np.append(t[1:], t[0] + period) - until
    numbers = np.concatenate([leaf.reshape(count, -1) for leaf in jax.tree.leaves(after)], axis=1)
    rounding = _SAME_TIME * np.finfo(d.dtype).eps * np.abs(until)
    itinerary = Itinerary(np.roll(event, -1).astype(np.int32), d <= rounding, mode)
    return itinerary, Arcs(until, numbers, d)
