"""Periodic orbits of hybrid systems."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float, Int

from impactjax._hybrid.equations import NO_EVENT
from impactjax._hybrid.lane import Start
from impactjax._hybrid.numbers import unpacked
from impactjax._hybrid.system import HybridSystem, Mode, State
from impactjax._response.linear import Linear, Vector, failure
from impactjax._results import RESULTS

_ONE = 1e-6  # distance from the unit circle that decides nothing


class OrbitEvents(NamedTuple):
    """The events of an orbit in a period, in order.

    - `t`: times.
    - `transition`: numbers of the transitions: the itinerary.
    - `before`, `after`: states before and after the jump.
    - `mode_before`: mode before it.
    """

    t: Float[np.ndarray, " events"]
    transition: Int[np.ndarray, " events"]
    before: State
    after: State
    mode_before: Mode


class Orbit(eqx.Module):
    """Periodic orbit of a hybrid system.

    - `system`: the system.
    - `start`: a point of the orbit: just after its first event; for an orbit without events, at the
      time where the search began, or where it went through the surface.
    - `period`: `multiple` periods of the force, or the time of as many returns to a surface.
    - `events`: the events in a period; the first one is at the start.
    - `multipliers`: Floquet multipliers, eigenvalues of the derivative of the state after a period
      by the state before it, through all events; the largest first. Without a force, that of a
      shift in time is 1.
    - `residual`: largest error of its equations, times in units of the period and each number of
      the state in units of its largest value.
    - `result`: `successful`, `no_orbit_found`, `another_itinerary`, or the failure of a flow.
    - `linear`: its equations, from which `follow` goes on.
    """

    system: HybridSystem
    start: Start
    period: float
    multiple: int
    events: OrbitEvents
    multipliers: Complex[np.ndarray, " numbers"]
    residual: float
    result: RESULTS
    linear: Linear

    @property
    def stability(self) -> str:
        """The stability in a word: stable, unstable or marginal."""
        largest = self.linear.largest()
        if abs(largest - 1) <= _ONE:
            return "marginal"
        return "stable" if largest < 1 else "unstable"


def orbit_of(linear: Linear, sizes: Vector, converged: bool) -> Orbit:
    """The orbit at some values of the unknowns, with its result code."""
    cycle = linear.cycle
    arcs, family = cycle.arcs(linear.unknowns), cycle.family
    mode = jax.tree.map(lambda leaf: leaf[0], cycle.itinerary.mode)
    return Orbit(
        jax.device_get(family.at(jnp.asarray(linear.unknowns[-1]))),
        Start(arcs.t[0], _state(arcs.y[0], family.like), mode),
        linear.period,
        cycle.multiple,
        events_of(linear),
        linear.multipliers(),
        float(np.max(np.abs(linear.residual / linear.row_sizes(sizes)))),
        _judged(linear, converged),
        linear,
    )


def _judged(linear: Linear, converged: bool) -> RESULTS:
    failed = failure(linear)
    if failed is not None:
        return failed
    if not converged:
        return RESULTS.no_orbit_found
    return RESULTS.successful if is_motion(linear) else RESULTS.another_itinerary


def is_motion(linear: Linear) -> bool:
    """True if the motion goes through the events of the itinerary, and no others."""
    pieces, itinerary = linear.pieces, linear.cycle.itinerary
    happens = (itinerary.event != NO_EVENT) & ~itinerary.at_once
    falls = np.all(pieces.fall[happens] <= 0)
    alone = np.all(pieces.least >= 0) and np.all(pieces.others >= 0)
    return bool(falls and alone and np.all(pieces.kept))


def events_of(linear: Linear) -> OrbitEvents:
    """The events of an orbit."""
    cycle = linear.cycle
    arcs, itinerary, like = cycle.arcs(linear.unknowns), cycle.itinerary, cycle.family.like
    count = cycle.segments if cycle.has_events else 0
    last_first = np.roll(np.arange(cycle.segments), 1)[:count]
    t = (arcs.t + arcs.d)[last_first]
    t[:1] -= linear.period
    return OrbitEvents(
        t,
        itinerary.event[last_first],
        states_of(linear.pieces.before[last_first], like),
        states_of(arcs.y[:count], like),
        jax.tree.map(lambda leaf: leaf[last_first], itinerary.mode),
    )


def _state(numbers: Float[np.ndarray, " numbers"], like: State) -> State:
    return jax.device_get(unpacked(jnp.asarray(numbers), like))


def states_of(rows: Float[np.ndarray, "events numbers"], like: State) -> State:
    """Rows of numbers as states."""
    return jax.device_get(jax.vmap(lambda row: unpacked(row, like))(jnp.asarray(rows)))
