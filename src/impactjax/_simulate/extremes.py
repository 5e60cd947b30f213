"""Where a motion turns within a step, and where a contact force peaks.

Both are zeros of a rate that falls through zero inside a known step: that of the penetration, and
that of the force. One such step is chosen an impact, and one a stop before which the mass turned in
flight, and the zero is found in it.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.chunks import CHUNK, map_rows
from impactjax._simulate.falling_zero import Bracket, falling_zero
from impactjax._simulate.flow import Wall, contact_force, walls
from impactjax._simulate.loop import Record
from impactjax._simulate.replay import Path
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.step import AbstractStep
from impactjax._types import Flag, Scalar

_PENETRATION, _FORCE = 0, 1

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
    """A step, and which level turns in it, if any does."""

    t: Scalar
    y: State
    mode: Mode
    expansion: PyTree
    exists: Flag
    which: Bool[Array, "2 stops"]


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

    def level(s: Scalar, parameters: tuple[ImpactOscillator, _Place]) -> tuple[Scalar, Scalar]:
        model, place = parameters
        y = step.evaluate(Automaton(model), place.mode, place.expansion, s)
        of_all = _levels(model, place.t + s, y, place.mode)
        value, rate = (jnp.sum(x, where=place.which) for x in of_all)
        return value, jnp.where(place.exists, rate, -s)  # harmless where nothing turns

    def peak(found: tuple[_Place, Bracket]) -> Scalar:
        place, bracket = found
        turn = falling_zero(lambda s, parameters: level(s, parameters)[1], bracket, (model, place))
        return level(turn, (model, place))[0]

    columns = path.t, path.y, record.log.mode, path.expansion, path.h
    t, y, mode, expansion, h = jax.tree.map(lambda column: column[sought.row], columns)
    at_start, at_end = (
        jnp.sum(x[sought.row], axis=(1, 2), where=sought.which) for x in (ends.rate, ends.end_rate)
    )
    high = jnp.where(sought.exists, h, 0.0)
    found = (
        _Place(t, y, mode, expansion, sought.exists, sought.which),
        Bracket(jnp.zeros_like(h), at_start, high, at_end),
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


def _force(model: ImpactOscillator, wall: Wall, y: State) -> Scalar:
    law = wall.stop.law
    if isinstance(law, AbstractForceLaw):
        return contact_force(model, wall, law, y)
    return jnp.zeros_like(y.position)
