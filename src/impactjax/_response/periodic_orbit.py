"""The verb `periodic_orbit`: hybrid system and start → orbit."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from impactjax._hybrid.arguments import as_tolerance
from impactjax._hybrid.ends import as_scale, as_start, flow_step, with_arrays
from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.numbers import packed
from impactjax._hybrid.surface import AbstractSurface
from impactjax._hybrid.system import HybridSystem, State
from impactjax._refusal import check_kind, whole
from impactjax._response.equations import Arcs, Family, Itinerary
from impactjax._response.first_motion import Accuracy, Motion, forced_motion
from impactjax._response.first_return import returning_motion
from impactjax._response.linear import Cycle, linearised
from impactjax._response.newton import fixed_parameter, sizes_of, solved
from impactjax._response.orbit import Orbit, orbit_of
from impactjax._response.period import Period, as_function
from impactjax._response.segment import Free

_TOLERANCE = 1e-12
_SAME_TIME = 8.0  # units in the last place


def periodic_orbit(
    system: HybridSystem,
    start: Start,
    period: Period | AbstractSurface,
    *,
    multiple: int = 1,
    settle: int = 0,
    tolerance: ArrayLike = _TOLERANCE,
    scale: State | None = None,
    max_steps: int = 4096,
    max_events: int = 64,
    step: AbstractMethod | None = None,
) -> Orbit:
    """Finds a periodic orbit of a hybrid system near a motion.

    The events of the motion in one period are recorded; they are the itinerary of the orbit. States
    just after these events, and times between them, are then found by multiple shooting: Newton's
    method on all of them at once, with exact derivatives through the events. An unstable orbit is
    found as well as a stable one. The system depends on time with the period of a force, or not at
    all: the period of the orbit is then another unknown.

    **Arguments:**

    - `system`, `start`: the system, and where the motion starts.
    - `period`: period of the force: a number, or a function of the system. For a system that does
      not depend on time, a surface to which the orbit returns: `AtTransition(0)` for an event,
      `Through(g)` for the zero of a function.
    - `multiple`: number of periods of the force, or of returns, in a period of the orbit.
    - `settle`: number of periods of the orbit that the motion is followed before its events are
      recorded.
    - `tolerance`, `scale`, `step`: as for `solve`.
    - `max_steps`: largest number of steps in a period, and between two events.
    - `max_events`: largest number of events in a period.

    **Raises** `ValueError` in single precision, for a period that is not positive or not that of
    the system, a surface for a system that depends on time or to which the motion does not return,
    for a motion that cannot be followed, and as `solve` does; `TypeError` for arguments of the
    wrong type.
    """
    check_kind("system", system, HybridSystem, "Ball(gravity, restitution)")
    check_kind("start", start, Start, "Start(t=0.0, y=y0)")
    multiple, settle = whole("multiple", multiple), whole("settle", settle, least=0)
    max_steps, max_events = whole("max_steps", max_steps), whole("max_events", max_events)
    dtype = jnp.result_type(float, *jax.tree.leaves(start.y))
    if jnp.finfo(dtype).bits < 64:
        raise ValueError("Periodic orbits need double precision: set `jax_enable_x64`.")
    allowed, own = as_tolerance(tolerance, dtype), _typed(with_arrays(system, dtype))
    begun = as_start(Start(start.t, start.y, start.mode), dtype)
    accuracy = Accuracy(allowed, scale, step, max_steps, max_events)
    if isinstance(period, AbstractSurface):
        motion = returning_motion(own, begun, period, multiple, settle, accuracy)
    else:
        force = as_function(period, own)
        motion = forced_motion(own, begun, force, multiple, settle, accuracy)
    begun = motion.start
    family = Family(
        flow_step(step, Equations(Free(own)), begun, allowed),
        own,
        jax.tree.map(jnp.zeros_like, eqx.filter(own, eqx.is_inexact_array)),
        motion.rhythm,
        jax.device_get(begun.y),
        as_scale(scale, begun.y, dtype),
        jnp.asarray(allowed, dtype),
        max_steps,
    )
    itinerary, arcs = _recorded(motion)
    cycle = Cycle(family, itinerary, multiple, float(jnp.asarray(begun.t)))
    linear = linearised(cycle, cycle.packed(arcs, 0.0))
    sizes = sizes_of(linear, 1.0)
    found = solved(linear, sizes, fixed_parameter(linear.unknowns, sizes))
    return orbit_of(found.linear, sizes, found.converged)


def _typed(system: HybridSystem) -> HybridSystem:
    """A system whose arrays have types of their own, since weak types would cause a retrace."""
    return jax.tree.map(
        lambda leaf: jnp.asarray(leaf, leaf.dtype) if eqx.is_array(leaf) else leaf, system
    )


def _recorded(motion: Motion) -> tuple[Itinerary, Arcs]:
    """Itinerary and segments of a motion, each segment from just after an event."""
    (t, until, event, after, mode), count = motion.events, len(motion.events.t)
    if not count:
        start = motion.start
        mode = jax.tree.map(lambda leaf: np.asarray(leaf)[None], start.mode)
        row = np.asarray(packed(start.y))[None]
        t, d = np.asarray(start.t)[None], np.array([motion.duration])
        return Itinerary(np.full(1, NO_EVENT, np.int32), np.zeros(1, bool), mode), Arcs(t, row, d)
    d = np.append(t[1:], t[0] + motion.duration) - until
    numbers = np.concatenate([leaf.reshape(count, -1) for leaf in jax.tree.leaves(after)], axis=1)
    rounding = _SAME_TIME * np.finfo(d.dtype).eps * np.abs(until)
    itinerary = Itinerary(np.roll(event, -1).astype(np.int32), d <= rounding, mode)
    return itinerary, Arcs(until, numbers, d)
