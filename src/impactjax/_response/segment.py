"""Motion between two events, without any event: the flow of one mode for a given time.

It goes on smoothly beyond a guard. Equations of an orbit are therefore smooth also where the orbit
grazes.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._hybrid.ends import begin
from impactjax._hybrid.equations import Equations, choose
from impactjax._hybrid.lane import Point, Start
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import HybridSystem, Mode, State, Transition
from impactjax._results import RESULTS
from impactjax._types import Code, Flag, Scalar

_PARTS = 8  # of a step, in each of which a guard has at most one minimum
_ITERATIONS = 6  # of Newton's method for the place of a minimum

_Guards = Float[Array, " guards"]


class Free(HybridSystem):
    """The flow of a system without its events."""

    system: HybridSystem

    def flow(self, t: Scalar, y: State, mode: Mode) -> State:
        return self.system.flow(t, y, mode)

    def transitions(self) -> Sequence[Transition]:
        return []


class Segment(NamedTuple):
    """Motion of one mode.

    - `end`: the state at its end.
    - `least`: the least local minimum of each guard inside; infinite without a minimum.
    - `result`: result code.
    """

    end: State
    least: _Guards
    result: RESULTS


class _Carry(NamedTuple):
    s: Scalar  # time since the start
    point: Point
    least: _Guards
    steps: Code
    done: Flag
    result: RESULTS


def flown(
    step: AbstractFlowStep,
    system: HybridSystem,
    start: Start,
    duration: Scalar,
    tolerance: Scalar,
    scale: State,
    max_steps: int,
) -> Segment:
    """The segment from `start`, differentiable in forward mode.

    Durations of the steps but the last one have no derivatives: their sum is what counts.
    """
    watched, free = Equations(system), Equations(Free(system))
    t0 = jnp.asarray(start.t)

    def unfinished(carry: _Carry) -> Flag:
        return ~carry.done

    def one_step(carry: _Carry) -> _Carry:
        point = carry.point._replace(t=t0 + carry.s)
        still = jax.lax.stop_gradient((free, point, tolerance, scale))
        attempt = step.attempt(*still)
        last = attempt.accepted & (attempt.h >= jax.lax.stop_gradient(duration) - carry.s)
        h = jnp.where(last, duration - carry.s, attempt.h)
        mode, zero = point.mode, jnp.zeros_like(h)
        expansion = step.expand(free, point.t, point.y, mode, attempt.unit)
        end = step.evaluate(free, point.y, mode, expansion, h, zero)

        def guards(s: Scalar) -> _Guards:
            y = step.evaluate(free, point.y, mode, expansion, s, zero)
            return watched.guard_values(point.t + s, y, mode)

        least = carry.least
        if watched.count():
            least = jnp.minimum(least, _least_minimum(guards, h))
        steps = carry.steps + 1
        result = RESULTS.where(steps < max_steps, RESULTS.successful, RESULTS.max_steps_reached)
        result = RESULTS.where(last, RESULTS.successful, result)
        finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(end)]))
        result = RESULTS.where(finite, result, RESULTS.non_finite)
        accepted = attempt.accepted
        after = Point(t0, choose(accepted, end, point.y), mode, point.memory)
        after = after._replace(memory=point.memory._replace(step=attempt.memory))
        s = jax.lax.stop_gradient(jnp.where(accepted, carry.s + h, carry.s))
        least = jnp.where(accepted, least, carry.least)
        done = last | (result != RESULTS.successful)
        return _Carry(s, after, least, steps, done, result)

    point = begin(step, free, start)
    nothing = jnp.full(watched.count(), jnp.inf, t0.dtype)
    no = jnp.zeros((), bool)
    carry = _Carry(jnp.zeros_like(t0), point, nothing, jnp.int32(0), no, RESULTS.successful)
    done = jax.lax.while_loop(unfinished, one_step, carry)
    return Segment(done.point.y, jax.lax.stop_gradient(done.least), done.result)


def _least_minimum(guards: Callable[[Scalar], _Guards], h: Scalar) -> _Guards:
    """The least local minimum of each guard inside a step."""

    def slopes(s: Scalar) -> _Guards:
        return jax.jvp(guards, (s,), (jnp.ones_like(s),))[1]

    h = jax.lax.stop_gradient(h)
    places = h * jnp.linspace(0.0, 1.0, _PARTS + 1, dtype=h.dtype)
    values, slope = jax.vmap(guards)(places), jax.vmap(slopes)(places)
    inside = (slope[:-1] < 0) & (slope[1:] >= 0)
    lower = jnp.where(inside, jnp.minimum(values[:-1], values[1:]), jnp.inf)
    part = jnp.argmin(lower, axis=0)

    def of_guard(number: Code, part: Code) -> Scalar:
        low, high = places[part], places[part + 1]
        before, after = slope[part, number], slope[part + 1, number]
        first = low + (high - low) * before / jnp.where(before == after, 1.0, before - after)

        def improve(_: Code, s: Scalar) -> Scalar:
            own, bend = jax.jvp(lambda s: slopes(s)[number], (s,), (jnp.ones_like(s),))
            return jnp.clip(s - own / jnp.where(bend == 0, 1.0, bend), low, high)

        return guards(jax.lax.fori_loop(0, _ITERATIONS, improve, first))[number]

    numbers = jnp.arange(values.shape[1], dtype=part.dtype)
    found = jax.vmap(of_guard)(numbers, part)
    return jnp.where(jnp.any(inside, axis=0), found, jnp.inf)
