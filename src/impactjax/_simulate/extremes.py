"""Where a motion turns within a step, and where a contact force peaks.

Both are zeros of a rate that falls through zero inside a known step: that of the penetration, and
that of the force. One such step is chosen an impact and the zero is found in it.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.chunks import CHUNK, map_rows
from impactjax._simulate.flow import Wall, contact_force, walls
from impactjax._simulate.loop import Log, Record
from impactjax._simulate.replay import Path
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.step import AbstractStep
from impactjax._types import Code, Scalar

_SECANTS = 10

Slots = Int[Array, " steps"]
PerStep = Float[Array, " steps"]
Value = Callable[[Scalar, State, Mode], Scalar]


class Extremes(NamedTuple):
    """Of each impact: deepest penetration [m] and peak force [N], zero at a rigid stop."""

    penetration: Float[Array, " impacts"]
    force: Float[Array, " impacts"]


class _Bracket(NamedTuple):
    low: Scalar
    at_low: Scalar
    high: Scalar
    at_high: Scalar


class _Row(NamedTuple):
    t: Scalar
    y: State
    mode: Mode
    expansion: PyTree
    h: Scalar


def extremes(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    slots: Slots,
    count: int,
) -> Extremes:
    """The extremes of `count` impacts, where `slots` tells to which impact a step belongs."""
    if not any(isinstance(wall.stop.law, AbstractForceLaw) for wall in walls(model)):
        return Extremes(*(jnp.zeros(count, path.t.dtype),) * 2)
    automaton = Automaton(model)
    touching = record.log.taken & (record.log.mode.phase == Phase.CONTACT)
    slots = jnp.where(touching & (slots >= 0), slots, count)

    def depth(t: Scalar, y: State, mode: Mode) -> Scalar:
        del t
        lever = model.oscillator.lever()
        return _of_stop(model, mode, lambda wall: -lever * wall.clearance(y.position))

    def force(t: Scalar, y: State, mode: Mode) -> Scalar:
        del t
        return _of_stop(model, mode, lambda wall: _force(model, wall, y))

    def largest(value: Value) -> Float[Array, " impacts"]:
        peaks = _peaks(automaton, path, record.log, value)
        row, exists = _choose(peaks.turns, peaks.level, slots, count)
        inside = _at_zero_rate(step, automaton, path, record, value, row)
        first, begins = _choose(touching, -path.t, slots, count)
        at_touch = jnp.where(begins, peaks.start[first], 0.0)
        return jnp.where(exists, jnp.maximum(inside, at_touch), at_touch)

    return Extremes(largest(depth), largest(force))


def nearest_miss(step: AbstractStep, model: ImpactOscillator, path: Path, record: Record) -> Scalar:
    """How close the mass came to a stop at the closest turn before it [m]; infinite without one."""
    automaton, log = Automaton(model), record.log
    flying = log.taken & (log.mode.phase == Phase.FLIGHT)
    nearest = jnp.full_like(path.t[0], jnp.inf)
    for wall in walls(model):

        def nearness(t: Scalar, y: State, mode: Mode, wall: Wall = wall) -> Scalar:
            del t, mode
            return -model.oscillator.lever() * wall.clearance(y.position)

        peaks = _peaks(automaton, path, log, nearness)
        row, exists = _choose(flying & peaks.turns, peaks.level, jnp.zeros_like(log.event), 1)
        inside = _at_zero_rate(step, automaton, path, record, nearness, row)
        nearest = jnp.minimum(nearest, jnp.where(exists, -inside, jnp.inf)[0])
    return nearest


class _Peaks(NamedTuple):
    """Of a quantity over each step."""

    turns: Bool[Array, " steps"]  # whether its rate falls through zero
    level: PerStep  # its larger end value
    start: PerStep


def _peaks(automaton: Automaton, path: Path, log: Log, value: Value) -> _Peaks:
    rated = jax.vmap(partial(_rated, automaton, value))
    start, rate = rated(path.t, path.y, log.mode)
    end, end_rate = rated(path.t + path.h, path.end, log.mode)
    return _Peaks((rate > 0) & (end_rate <= 0), jnp.maximum(start, end), start)


def _rated(
    automaton: Automaton, value: Value, t: Scalar, y: State, mode: Mode
) -> tuple[Scalar, Scalar]:
    """A quantity and its rate along the flow."""
    flow = automaton.flow(t, y, mode)
    return jax.jvp(lambda t, y: value(t, y, mode), (t, y), (jnp.ones_like(t), flow))


def _choose(
    among: Bool[Array, " steps"], score: PerStep, slots: Slots, count: int
) -> tuple[Int[Array, " impacts"], Bool[Array, " impacts"]]:
    """The step with the highest score of each slot, and whether there is one."""
    score = jax.lax.stop_gradient(score)
    slots = jnp.where(among, slots, count)
    best = jnp.full(count, -jnp.inf, score.dtype).at[slots].max(score, mode="drop")
    wins = among & (score == best.at[slots].get(mode="fill", fill_value=jnp.inf))
    numbers = jnp.arange(score.shape[0], dtype=jnp.int32)
    row = jnp.zeros(count, jnp.int32).at[jnp.where(wins, slots, count)].set(numbers, mode="drop")
    return row, jnp.isfinite(best)


def _at_zero_rate(
    step: AbstractStep,
    automaton: Automaton,
    path: Path,
    record: Record,
    value: Value,
    rows: Int[Array, " impacts"],
) -> Float[Array, " impacts"]:
    """The quantity where its rate is zero within each of some steps."""
    chosen = jax.tree.map(
        lambda column: column[rows],
        _Row(path.t, path.y, record.log.mode, path.expansion, path.h),
    )

    def peak(row: _Row) -> Scalar:
        def rated(s: Scalar) -> tuple[Scalar, Scalar]:
            y = step.evaluate(automaton, row.mode, row.expansion, s)
            return _rated(automaton, value, row.t + s, y, row.mode)

        return rated(falling_zero(lambda s: rated(s)[1], row.h))[0]

    return map_rows(peak, chosen, record.passes, CHUNK)


def falling_zero(rate: Callable[[Scalar], Scalar], h: Scalar) -> Scalar:
    """Where a rate falls through zero within (0, h]: by secants in a bracket, the end that stays
    losing half its weight each time, then once by Newton's method for the derivatives.
    """

    def improve(_: Code, bracket: _Bracket) -> _Bracket:
        low, at_low, high, at_high = bracket
        s = high - at_high * (high - low) / (at_high - at_low)
        s = jnp.where((s > low) & (s < high), s, (low + high) / 2)
        value = rate(s)
        rises = value > 0
        return _Bracket(
            jnp.where(rises, s, low),
            jnp.where(rises, value, at_low / 2),
            jnp.where(rises, high, s),
            jnp.where(rises, at_high / 2, value),
        )

    zero = jnp.zeros_like(h)
    start = _Bracket(zero, rate(zero), h, rate(h))
    end = jax.lax.fori_loop(0, _SECANTS, improve, jax.lax.stop_gradient(start))
    root = jax.lax.stop_gradient((end.low + end.high) / 2)
    value, slope = jax.jvp(rate, (root,), (jnp.ones_like(root),))
    slope = jax.lax.stop_gradient(slope)
    return root - value / jnp.where(slope < 0, slope, -jnp.inf)


def _force(model: ImpactOscillator, wall: Wall, y: State) -> Scalar:
    law = wall.stop.law
    if isinstance(law, AbstractForceLaw):
        return contact_force(model, wall, law, y)
    return jnp.zeros_like(y.position)


def _of_stop(model: ImpactOscillator, mode: Mode, value: Callable[[Wall], Scalar]) -> Scalar:
    """The value of the stop that a mode is at."""
    found = [value(wall) for wall in walls(model)]
    chosen = found[0]
    for number, other in enumerate(found[1:], start=1):
        chosen = jnp.where(mode.stop == number, other, chosen)
    return chosen
