"""The first event of a step, from the series of the guards."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from impactjax._hybrid.equations import NO_EVENT
from impactjax._hybrid.lane import Memory
from impactjax._series.crossing import first_crossing
from impactjax._series.polynomial import horner_with_slope
from impactjax._types import Code, Flag, Scalar

_ROUNDING = 4096.0  # units in the last place of the size of a guard
_CLOSE = 0.5  # of a step: at most as far ahead is the zero of a guard being landed on
_FLIGHTS = 2.0  # a step from a guard is at most as long as this many expected returns to it

Guards = list[Float[Array, " guards"]]  # coefficients, in order


class Armed(NamedTuple):
    """Guards on a step, with time in units of its duration.

    - `armed`: true for each guard whose fall is an event.
    - `at_once`: true for each guard whose event happens at the start.
    """

    series: Guards
    armed: Bool[Array, " guards"]
    at_once: Bool[Array, " guards"]


class Found(NamedTuple):
    """End of a step by a guard.

    - `guard`: the guard that falls or rises, or `NO_EVENT`.
    - `event`: the same if it falls, else `NO_EVENT`.
    - `caused`: true if it has been made negative by the jump before.
    - `fraction`: its place; infinite if nothing ends the step.
    - `unclear`: true if a shorter step is needed to tell.
    - `armed`: as in `Memory`, after the step.
    """

    guard: Code
    event: Code
    caused: Flag
    fraction: Scalar
    unclear: Flag
    armed: Bool[Array, " guards"]


def cleaned(
    series: Guards, sway: Float[Array, " guards"], usual: Scalar, memory: Memory, tolerance: Scalar
) -> Guards:
    """Guards that start at exactly zero if they are zero up to rounding.

    `sway` is the change of the guards if all numbers that they are made of change by their size,
    `usual` the length of a usual step. A guard's size is its own within the time in which its slope
    changes, or its sway: a step of exact flights is so long that all would be zero in comparison.

    Just after an event, a guard counts as zero within the tolerance, since an event at the same
    time is known no better. The guard of the event itself counts as zero if the jump left it there.
    """
    value, slope, bend = map(jnp.abs, series[:3])
    turn = jnp.where(bend == 0, usual, slope / jnp.where(bend == 0, 1.0, bend))
    path = slope * jnp.minimum(turn, usual)
    size = jnp.maximum(jnp.maximum(value, path), jnp.abs(sway))
    here = jnp.arange(value.size, dtype=jnp.int32) == memory.arrival
    rounding = _ROUNDING * np.finfo(value.dtype).eps
    allowed = jnp.where(memory.arrival != NO_EVENT, tolerance, rounding)
    zero = (value <= allowed * size) | (here & memory.stays)
    return [jnp.where(zero, 0.0, series[0]), *series[1:]]


def until_return(series: Guards) -> Scalar:
    """Longest step from a guard that rises from zero and returns to it."""
    value, slope, bend = series[:3]
    returns = (value == 0) & (slope > 0) & (bend < 0)
    times = jnp.where(returns, -slope / jnp.where(returns, bend, 1.0), jnp.inf)
    return _FLIGHTS * jnp.min(times, initial=jnp.inf)


def arm(series: Guards, memory: Memory, tolerance: Scalar) -> Armed:
    """The guards of a step, of which those that fall cause an event.

    If the guard of an event goes on falling after it, the jump has let the state pass through, and
    the next event waits until the guard has risen. If it neither rises nor falls, the way it bends
    decides. A guard that has become negative by the jump of another event falls at once.
    """
    value, slope = series[0], series[1]
    size = jnp.max(jnp.abs(jnp.stack(series)), axis=0)
    here = jnp.arange(value.size, dtype=jnp.int32) == memory.arrival
    zero = value == 0
    flat = zero & (jnp.abs(slope) <= tolerance * size)
    passes = here & zero & ~flat & (slope < 0)
    rises = jnp.where(zero, ~flat & (slope > 0), value > 0)
    armed = (memory.armed & ~passes) | rises
    at_once = armed & (value < 0) & (memory.arrival != NO_EVENT)
    return Armed([value, jnp.where(flat, 0.0, slope), *series[2:]], armed, at_once)


def watch(
    armed: Armed, settle: Flag, margin: Float[Array, " guards"] | float, target: Code
) -> Found:
    """The end of a step: an event, or the rise of a guard that has not been armed.

    The rise ends a step too, since the fall after it must be found. `margin` is the error of the
    series between its ends. The guard `target` also ends a step that stops just before its zero.
    At one place a fall comes before a rise, which its jump may prevent.
    """
    count = armed.armed.size
    if count == 0:
        never = jnp.asarray(jnp.inf, armed.series[0].dtype)
        none = jnp.int32(NO_EVENT)
        no = jnp.zeros((), bool)
        return Found(none, none, no, never, no, armed.armed)
    sign = jnp.where(armed.armed, 1.0, -1.0).astype(armed.series[0].dtype)
    signed = [sign * coefficient for coefficient in armed.series]
    crossing = first_crossing(signed, settle, margin)
    places = jnp.where(armed.at_once, 0.0, crossing.fraction)
    value, slope = horner_with_slope(signed, jnp.ones_like(sign))
    numbers = jnp.arange(count, dtype=jnp.int32)
    ahead = 1 - value / jnp.where(slope == 0, 1.0, slope)
    close = (numbers == target) & (jnp.abs(ahead - 1) < _CLOSE) & (slope < 0)
    places = jnp.where(jnp.isinf(places) & close, ahead, places)
    place = jnp.min(places)
    first = jnp.argmax(jnp.where(places == place, 1 + armed.armed.astype(jnp.int32), 0))
    guard = jnp.where(jnp.isfinite(place), first, NO_EVENT).astype(jnp.int32)
    event = jnp.where(armed.armed[first], guard, NO_EVENT).astype(jnp.int32)
    unclear = jnp.any(crossing.unclear & ~armed.at_once) & (place > 0)
    risen = armed.armed | (numbers == guard)
    return Found(guard, event, armed.at_once[first], place, unclear, risen)
