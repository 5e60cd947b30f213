"""The first transition within a step, from the guards and their derivatives at both ends."""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp

from impactjax._series.quintic import watched
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.state import Mode, State
from impactjax._simulate.step import Point
from impactjax._types import Code, Flag, Scalar

_STEEP = 10.0  # slope of a guard, over its size and the step, at the end of a vanishing force

Value = TypeVar("Value", Scalar, list[Scalar])


def first_event(
    automaton: Automaton, start: Point, end: State, h: Scalar, target: Code, settle: Flag
) -> tuple[Code, Scalar, Flag]:
    """The first transition on a step, its place as a fraction of the step, and a flag if it is
    unclear. The transition `target` also counts if the step ends just before it.

    A contact force may vanish at the surface with an infinite slope, beyond which its guard is zero
    with a slope of zero. A guard that ends so has no zero before; the passage of the surface is the
    event.
    """
    before = _guard_jets(automaton, start.t, start.y, start.mode)
    after = _guard_jets(automaton, start.t + h, end, start.mode)
    before = automaton.just_after(start.arrival, start.mode, before)
    event, fraction, unclear = jnp.int32(NO_EVENT), jnp.full_like(h, jnp.inf), jnp.zeros((), bool)
    for index, (jet0, jet1) in enumerate(zip(before, after, strict=True)):
        crossing = watched(jet0, jet1, h, settle)
        ahead = 1 - jet1[0] / (jet1[1] * h)
        close = (target == index) & (jnp.abs(ahead - 1) < 0.5)
        own = jnp.where(jnp.isinf(crossing.fraction) & close, ahead, crossing.fraction)
        slope, size = jnp.abs(jet1[1]) * h, jnp.abs(jet0[0]) + jnp.abs(jet1[0])
        gone = (jet1[0] == 0) & (slope == 0)
        vanishes = gone | ((jet1[0] >= 0) & ~(slope <= _STEEP * size))
        own = jnp.where(vanishes, jnp.inf, own)
        earlier = own < fraction
        event = jnp.where(earlier, index, event).astype(jnp.int32)
        fraction = jnp.where(earlier, own, fraction)
        unclear = unclear | (crossing.unclear & ~vanishes)
    return event, fraction, unclear & (fraction > 0)


def _guard_jets(
    automaton: Automaton, t: Scalar, y: State, mode: Mode
) -> list[tuple[Scalar, Scalar, Scalar]]:
    """Each guard with its first and second derivative in time along the flow."""

    def value(t: Scalar, y: State) -> list[Scalar]:
        return automaton.guards(t, y, mode)

    def derivative(t: Scalar, y: State) -> list[Scalar]:
        return along_flow(automaton, value, t, y, mode)

    first = derivative(t, y)
    second = along_flow(automaton, derivative, t, y, mode)
    return list(zip(value(t, y), first, second, strict=True))


def along_flow(
    automaton: Automaton,
    function: Callable[[Scalar, State], Value],
    t: Scalar,
    y: State,
    mode: Mode,
) -> Value:
    """Time derivative of a function of time and state along the flow of the mode."""
    return jax.jvp(function, (t, y), (jnp.ones_like(t), automaton.flow(t, y, mode)))[1]
