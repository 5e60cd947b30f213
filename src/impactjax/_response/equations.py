"""Equations of a periodic orbit with a given itinerary, and their exact derivatives.

An orbit is a chain of segments, each from just after an event up to and through the next one. A
segment starts at time t with the state y and lasts d; it leads to

- t⁺ = t + d (and the duration of a tail) and y⁺ = jump(t + d, x(d; t, y)),
- a condition: the guard of the event at its end, g(t + d, x) = 0; d = 0 if the event happens at the
  time of the one before. An orbit without events ends after the period of the force, or on a plane
  (see `rhythm.py`).
"""

from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._hybrid.equations import NO_EVENT, Equations, same
from impactjax._hybrid.lane import Start
from impactjax._hybrid.numbers import packed, unpacked
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import HybridSystem, Mode, State
from impactjax._known import AnyArray
from impactjax._response.rhythm import AbstractRhythm
from impactjax._response.segment import flown
from impactjax._results import RESULTS
from impactjax._types import Scalar

_PASSED = 1e-6  # of its change: up to this, a guard is zero at the start of a segment


class Itinerary(NamedTuple):
    """Sequence of events of an orbit, one row for each segment.

    - `event`: the transition at the end of the segment; −1 for an orbit without events.
    - `at_once`: true if it happens at the time of the event before.
    - `mode`: mode during the segment.
    """

    event: Int[AnyArray, "*segments"]
    at_once: Bool[AnyArray, "*segments"]
    mode: Mode


class Arcs(NamedTuple):
    """The segments of an orbit: the unknowns of its equations.

    - `t`, `y`: time and state, as one row of numbers, at the start of each segment.
    - `d`: their durations.
    """

    t: Float[AnyArray, "*segments"]
    y: Float[AnyArray, "*segments numbers"]
    d: Float[AnyArray, "*segments"]


class Pieces(NamedTuple):
    """Outcome of each segment, with derivatives.

    - `after`: time and state after its end, and its condition.
    - `slopes`: derivatives of `after` by start time, state, duration and parameter.
    - `before`: state at its end, before the jump.
    - `rate`: time derivative of the state at its start.
    - `fall`: rate of the guard of its event at its end.
    - `least`: least local minimum of each guard inside.
    - `others`: guards at its end, that of its event left out.
    - `wait`: duration of an endless series of events that is summed at its end.
    - `kept`: true if the jump leads to the mode of the next segment.
    - `result`: result code of its flow.
    """

    after: Float[AnyArray, "*segments outcomes"]
    slopes: Float[AnyArray, "*segments outcomes unknowns"]
    before: Float[AnyArray, "*segments numbers"]
    rate: Float[AnyArray, "*segments numbers"]
    fall: Float[AnyArray, "*segments"]
    least: Float[AnyArray, "*segments guards"]
    others: Float[AnyArray, "*segments guards"]
    wait: Float[AnyArray, "*segments"]
    kept: Bool[AnyArray, "*segments"]
    result: RESULTS


class Family(eqx.Module):
    """Systems along a line in the space of their parameters.

    - `system`: one of them.
    - `along`: a tree like it, the change of its arrays with the parameter of the line.
    - `rhythm`: origin of the period.
    - `like`: a state.
    - `scale`: sizes below which its numbers need no accuracy.
    """

    step: AbstractFlowStep
    system: HybridSystem
    along: HybridSystem
    rhythm: AbstractRhythm
    like: State
    scale: State
    tolerance: Scalar
    max_steps: int = eqx.field(static=True)

    def at(self, parameter: Scalar) -> HybridSystem:
        """The system at a parameter of the line."""
        change = jax.tree.map(lambda each: parameter * each, self.along)
        return eqx.apply_updates(self.system, change)

    def period_at(self, parameter: Scalar, elapsed: Scalar) -> Scalar:
        """The period there, of the force or of a motion that takes the time `elapsed`."""
        return self.rhythm.period(self.at(parameter), elapsed)


@eqx.filter_jit
def pieces_of(
    family: Family,
    itinerary: Itinerary,
    following: Mode,
    arcs: Arcs,
    parameter: Scalar,
    multiple: Scalar,
    segments: Scalar,
) -> tuple[Pieces, Scalar, Scalar]:
    """The segments of an orbit, its period, and the derivative of the period by the parameter.

    One compiled program for all values: only the number of segments causes another one.
    `following` is the mode of the next segment of each, `multiple` the number of periods of the
    force, and `segments` that of segments, since more may follow that do not belong to the orbit.
    """
    one = partial(_piece, family, multiple / segments)
    pieces = jax.vmap(one, in_axes=(0, 0, 0, None))(itinerary, following, arcs, parameter)
    last = segments.astype(jnp.int32) - 1
    elapsed = (pieces.after[last, 0] - arcs.t[0]) / multiple
    period, slope = jax.value_and_grad(family.period_at)(parameter, elapsed)
    return pieces, multiple * period, multiple * slope


def _piece(
    family: Family,
    share: Scalar,
    itinerary: Itinerary,
    following: Mode,
    arc: Arcs,
    parameter: Scalar,
) -> Pieces:
    event, at_once, mode = itinerary

    def outcome(
        t: Scalar, y: Array, d: Scalar, parameter: Scalar
    ) -> tuple[Array, tuple[Array | RESULTS, ...]]:
        system = family.at(parameter)
        equations, start = Equations(system), Start(t, unpacked(y, family.like), mode)
        end = flown(family.step, system, start, d, family.tolerance, family.scale, family.max_steps)
        jump = equations.jump(event, t + d, end.end, mode, following)

        def guards(t: Scalar, y: State) -> Array:
            return equations.guard_values(t, y, mode)

        def rates(t: Scalar, y: State) -> tuple[State, Array, Array]:
            rate = equations.flow(t, y, mode)
            return rate, *jax.jvp(guards, (t, y), (jnp.ones_like(t), rate))

        numbers = jnp.arange(equations.count(), dtype=jnp.int32)
        own = numbers == event
        rate, first, slope = rates(t, start.y)
        _, last, fall = rates(t + d, end.end)
        condition = jnp.sum(jnp.where(own, last, 0.0))
        condition = jnp.where(at_once, d, condition)
        whole = family.rhythm.end(system, packed(end.end), d / share)
        condition = jnp.where(event == NO_EVENT, whole, condition)
        after = jnp.concatenate([(t + d + jump.wait)[None], packed(jump.y), condition[None]])
        near = _PASSED * jnp.abs(slope * d)
        passed = (first < -near) | ((first <= near) & (slope < 0))
        return after, (
            packed(end.end),
            packed(rate),
            jnp.sum(jnp.where(own, fall, 0.0)),
            jnp.where(passed, jnp.inf, end.least),
            jnp.where(passed | own, jnp.inf, last),
            jump.wait,
            same(jump.mode, following),
            end.result,
            after,
        )

    slopes, (*seen, after) = jax.jacfwd(outcome, argnums=(0, 1, 2, 3), has_aux=True)(
        *arc, parameter
    )
    columns = [each.reshape(after.size, -1) for each in slopes]
    return Pieces(after, jnp.concatenate(columns, axis=1), *seen)
