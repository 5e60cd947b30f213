"""Motion over a period near which an orbit is sought."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from impactjax._hybrid.event_log import EventLog
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.numbers import packed
from impactjax._hybrid.solution import Solution
from impactjax._hybrid.solve import solve
from impactjax._hybrid.system import HybridSystem, Mode, State
from impactjax._known import AnyArray
from impactjax._response.period import Force
from impactjax._response.rhythm import AbstractRhythm, OfForce
from impactjax._results import RESULTS
from impactjax._types import Scalar

_SAME_RATE = 1e-6  # relative difference of rates that are the same
_SHARES = (0.0, 0.37)  # of a period, at which rates are compared


class Accuracy(NamedTuple):
    """Arguments of runs, as those of `solve`."""

    tolerance: AnyArray
    scale: State | None
    step: AbstractMethod | None
    max_steps: int
    max_events: int

    def followed(self, system: HybridSystem, start: Start, until: AnyArray) -> Solution:
        """The motion up to a time. Raises `ValueError` if it fails."""
        run = solve(
            system,
            start,
            jnp.reshape(until, 1),
            tolerance=self.tolerance,
            scale=self.scale,
            max_steps=self.max_steps,
            max_events=self.max_events,
            step=self.step,
        )
        if run.result != RESULTS.successful:
            raise ValueError(f"The motion cannot be followed for a period: {RESULTS[run.result]}")
        return run


class Happened(NamedTuple):
    """Events in a period: times, times until which they last, numbers, states and modes after."""

    t: Float[np.ndarray, " events"]
    until: Float[np.ndarray, " events"]
    transition: Int[np.ndarray, " events"]
    after: State
    mode: Mode


class Motion(NamedTuple):
    """Motion over a period, with its events, and the origin of the period."""

    start: Start
    duration: float
    rhythm: AbstractRhythm
    events: Happened


def forced_motion(
    system: HybridSystem, start: Start, force: Force, multiple: int, settle: int, accuracy: Accuracy
) -> Motion:
    """The motion over a number of periods of a force, once it has settled for `settle` times as
    long.

    **Raises** `ValueError` for a motion that cannot be followed, and a wrong period.
    """
    period = jnp.asarray(force(system), jnp.asarray(start.t).dtype)
    _check_repeats(system, start, period)
    until = start.t + multiple * period
    for _ in range(settle):
        run = accuracy.followed(system, start, until)
        y, mode = jax.tree.map(lambda column: column[-1], (run.ys, run.modes))
        start = Start(start.t, y, mode)  # the force repeats, and small times are exact
    events = happened(accuracy.followed(system, start, until).events)
    return Motion(start, float(multiple * period), OfForce(force), events)


def happened(events: EventLog) -> Happened:
    """The events of a log."""
    log = jax.device_get(events)
    columns = Happened(log.t, log.until, log.transition, log.after, log.mode_after)
    return jax.tree.map(lambda column: column[: int(log.count)], columns)


def rates_at(system: HybridSystem, start: Start, period: AnyArray, later: float) -> np.ndarray:
    """Rates at the state of a start at some times of a period, `later` periods later."""
    ts = [jnp.asarray(start.t + (share + later) * period) for share in _SHARES]
    return np.stack([np.asarray(_rates(system, start, t)) for t in ts])


def _check_repeats(system: HybridSystem, start: Start, period: Array) -> None:
    """Raises `ValueError` if the rates at the start are not the same a period later."""
    now, later = (rates_at(system, start, period, shift) for shift in (0.0, 1.0))
    size = np.max(np.abs(now), axis=1, keepdims=True, initial=1e-300)
    if not np.all(np.abs(later - now) <= _SAME_RATE * size):
        raise ValueError(
            f"Argument `period` is not that of the system: rates change within {period}."
        )


@eqx.filter_jit
def _rates(system: HybridSystem, start: Start, t: Scalar) -> Array:
    """Rates of a system at the state of a start, at any time."""
    return packed(system.flow(t, start.y, start.mode))
