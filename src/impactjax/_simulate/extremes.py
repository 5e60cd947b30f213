"""Where a motion turns within a step, and where a contact force peaks.

Both are zeros of a rate that falls through zero inside a known step: that of the penetration, and
that of the force. One such step is chosen an impact, and one a stop before which the mass turned in
flight, and the zero is found in it.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.chunks import CHUNK, map_rows
from impactjax._simulate.flow import Wall, contact_force, walls
from impactjax._simulate.loop import Record
from impactjax._simulate.replay import Path
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.step import AbstractStep
from impactjax._types import Code, Scalar

_SECANTS = 10
_PENETRATION, _FORCE = 0, 1

Operands = TypeVar("Operands", bound=PyTree)
Slots = Int[Array, " steps"]
PerImpact = Float[Array, " impacts"]
PerStep = Float[Array, " steps"]
Levels = Float[Array, "2 stops"]  # penetration [m] and force [N]


class Extremes(NamedTuple):
    """Of each impact the deepest penetration [m] and the peak force [N], zero at a rigid stop; and
    how close the mass came to a stop at the closest turn before it [m], infinite without one.
    """

    penetration: PerImpact
    force: PerImpact
    nearest_miss: Scalar


class _Ends(NamedTuple):
    """Levels and their rates at the ends of the steps."""

    start: Float[Array, "steps 2 stops"]
    rate: Float[Array, "steps 2 stops"]
    end: Float[Array, "steps 2 stops"]
    end_rate: Float[Array, "steps 2 stops"]


class _Sought(NamedTuple):
    """Of each slot the step in which a level turns the highest, and whether there is one."""

    row: Int[Array, " slots"]
    exists: Bool[Array, " slots"]
    which: Bool[Array, "slots 2 stops"]  # level


class _Place(NamedTuple):
    """A step, and the level that turns in it."""

    t: Scalar
    y: State
    mode: Mode
    expansion: PyTree
    which: Bool[Array, "2 stops"]


class Bracket(NamedTuple):
    """An interval at whose ends a rate is above zero, and not."""

    low: Scalar
    at_low: Scalar
    high: Scalar
    at_high: Scalar


def extremes(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    slots: Slots,
    count: int,
) -> Extremes:
    """The extremes of a run of `count` impacts, where `slots` tells to which one a step belongs."""
    nothing, far = jnp.zeros(count, path.t.dtype), jnp.full_like(path.t[0], jnp.inf)
    if not walls(model):
        return Extremes(nothing, nothing, far)
    log, stops = record.log, len(walls(model))
    levels = jax.vmap(functools.partial(_levels, model))
    ends = _Ends(
        *levels(path.t, path.y, log.mode),
        *levels(path.t + path.h, path.end, log.mode),
    )
    flying = log.taken & (log.mode.phase == Phase.FLIGHT)
    sought = [
        _highest_turns(
            ends, flying, _PENETRATION, jnp.full_like(slots, stop), jnp.zeros_like(slots), 1
        )
        for stop in range(stops)
    ]
    compliant = any(isinstance(wall.stop.law, AbstractForceLaw) for wall in walls(model))
    touching = log.taken & (log.mode.phase == Phase.CONTACT)
    slots = jnp.where(touching & (slots >= 0), slots, count)
    if compliant:
        both = [
            _highest_turns(ends, touching, quantity, log.mode.stop, slots, count)
            for quantity in (_PENETRATION, _FORCE)
        ]
        # In turn, so that the rows in use come first.
        sought.append(jax.tree.map(lambda *x: jnp.stack(x, 1).reshape(-1, *x[0].shape[1:]), *both))
    every = jax.tree.map(lambda *x: jnp.concatenate(x), *sought)
    inside = _at_turns(step, model, path, record, ends, every)
    missed = jnp.min(jnp.where(every.exists[:stops], -inside[:stops], jnp.inf))
    if not compliant:
        return Extremes(nothing, nothing, missed)
    first, begins = _choose(touching, -path.t, slots, count)
    own = log.mode.stop[first][:, None, None]
    at_touch = jnp.take_along_axis(ends.start[first], own, axis=2)[..., 0]
    at_touch = jnp.where(begins[:, None], at_touch, 0.0)
    exists, inside = (x[stops:].reshape(count, 2) for x in (every.exists, inside))
    highest = jnp.where(exists, jnp.maximum(inside, at_touch), at_touch)
    return Extremes(highest[:, _PENETRATION], highest[:, _FORCE], missed)


def _highest_turns(
    ends: _Ends,
    among: Bool[Array, " steps"],
    quantity: int,
    stop: Slots,
    slots: Slots,
    count: int,
) -> _Sought:
    """Among some steps, those in which a quantity of a stop turns."""

    def own(levels: Float[Array, "steps 2 stops"]) -> PerStep:
        return jnp.take_along_axis(levels[:, quantity], stop[:, None], axis=1)[:, 0]

    turns = among & (own(ends.rate) > 0) & (own(ends.end_rate) <= 0)
    row, exists = _choose(turns, jnp.maximum(own(ends.start), own(ends.end)), slots, count)
    stops = ends.start.shape[2]
    number = jnp.arange(2 * stops, dtype=stop.dtype).reshape(2, stops)
    return _Sought(row, exists, number == quantity * stops + stop[row][:, None, None])


def _at_turns(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    ends: _Ends,
    sought: _Sought,
) -> Float[Array, " slots"]:
    """The levels where they turn."""

    def level(operands: tuple[ImpactOscillator, _Place], s: Scalar) -> tuple[Scalar, Scalar]:
        model, place = operands
        y = step.evaluate(Automaton(model), place.mode, place.expansion, s)
        of_all = _levels(model, place.t + s, y, place.mode)
        value, rate = (jnp.sum(x, where=place.which) for x in of_all)
        return value, rate

    def rate(operands: tuple[ImpactOscillator, _Place], s: Scalar) -> Scalar:
        return level(operands, s)[1]

    def peak(found: tuple[_Place, Bracket]) -> Scalar:
        place, bracket = found
        return level((model, place), falling_zero(rate, (model, place), bracket))[0]

    columns = path.t, path.y, record.log.mode, path.expansion, path.h
    t, y, mode, expansion, h = jax.tree.map(lambda column: column[sought.row], columns)
    at_start, at_end = (
        jnp.sum(x[sought.row], axis=(1, 2), where=sought.which) for x in (ends.rate, ends.end_rate)
    )
    found = (
        _Place(t, y, mode, expansion, sought.which),
        Bracket(jnp.zeros_like(h), at_start, h, at_end),
    )
    slots, _, stops = sought.which.shape
    return map_rows(peak, found, stops + 2 * record.passes, min(CHUNK, slots))


@jax.jit  # so that it is traced once
def _levels(model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> tuple[Levels, Levels]:
    """Penetration and force of all stops, and their rates along the flow."""

    def levels(y: State) -> Levels:
        lever = model.oscillator.lever()
        penetrations = [-lever * wall.clearance(y.position) for wall in walls(model)]
        forces = [_force(model, wall, y) for wall in walls(model)]
        return jnp.stack([*penetrations, *forces]).reshape(2, -1)

    return jax.jvp(levels, (y,), (Automaton(model).flow(t, y, mode),))


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


@functools.partial(jax.custom_jvp, nondiff_argnums=(0,))
def falling_zero(
    rate: Callable[[Operands, Scalar], Scalar], operands: Operands, bracket: Bracket
) -> Scalar:
    """Where s ↦ rate(operands, s) falls through zero, by secants in a bracket, of which an end that
    stays twice loses weight; with derivatives of any order.

    Source: Anderson and Björck, BIT 13, 253 (1973).
    """

    def improve(_: Code, state: tuple[Bracket, Scalar]) -> tuple[Bracket, Scalar]:
        (low, at_low, high, at_high), newer = state
        s = high - at_high * (high - low) / (at_high - at_low)
        s = jnp.where((s >= low) & (s <= high), s, (low + high) / 2)
        value = rate(operands, s)
        rises = value > 0
        share = 1 - value / jnp.where(rises, at_low, at_high)
        share = jnp.where(share > 0, share, 0.5)
        bracket = Bracket(
            jnp.where(rises, s, low),
            jnp.where(rises, value, jnp.where(newer > 0, share * at_low, at_low)),
            jnp.where(rises, high, s),
            jnp.where(rises, jnp.where(newer < 0, share * at_high, at_high), value),
        )
        return bracket, jnp.where(rises, -jnp.ones_like(s), jnp.ones_like(s))

    start = bracket, jnp.zeros_like(bracket.low)  # no end is newer
    end, newer = jax.lax.fori_loop(0, _SECANTS, improve, start)
    return jnp.where(newer < 0, end.low, end.high)


@falling_zero.defjvp
def _(
    rate: Callable[[Operands, Scalar], Scalar], primals: tuple, tangents: tuple
) -> tuple[Scalar, Scalar]:
    (operands, _), (d_operands, _) = primals, tangents
    zero = falling_zero(rate, *primals)
    _, change = jax.jvp(lambda operands: rate(operands, zero), (operands,), (d_operands,))
    _, slope = jax.jvp(lambda s: rate(operands, s), (zero,), (jnp.ones_like(zero),))
    falls = slope < 0
    return zero, jnp.where(falls, -change / jnp.where(falls, slope, -1.0), 0.0)


def _force(model: ImpactOscillator, wall: Wall, y: State) -> Scalar:
    law = wall.stop.law
    if isinstance(law, AbstractForceLaw):
        return contact_force(model, wall, law, y)
    return jnp.zeros_like(y.position)
