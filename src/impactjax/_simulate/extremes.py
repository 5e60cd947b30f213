"""Where a motion turns within a step, and where a contact force peaks.

Both are zeros of a rate that falls through zero inside a known step: that of the penetration, and
that of the force. In flight the penetration of every stop is followed; in contact penetration and
force of the stop that is touched. Each step is looked at in several places, so that two turns
within one do not hide each other, and its ends count too: a step may end just where the mass turns.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.chunks import CHUNK, map_rows
from impactjax._simulate.falling_zero import Bracket, falling_zero
from impactjax._simulate.flow import walls
from impactjax._simulate.lane import Record
from impactjax._simulate.levels import heights, is_compliant, levels_of
from impactjax._simulate.replay import Path
from impactjax._simulate.sliding import Sliding
from impactjax._simulate.state import Phase
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.tracks import Nodes, Tracks, nodes_of, tracks_of
from impactjax._types import Scalar

_PENETRATION, _FORCE = 0, 1

Slots = Int[Array, " steps"]
PerImpact = Float[Array, " impacts"]
PerStep = Float[Array, " steps"]


class Extremes(NamedTuple):
    """Of each impact the deepest penetration [m] and the peak force [N], zero at a rigid stop; and
    how close to a stop the mass turned before it, and the run ended on the way to it [m], infinite
    without.
    """

    penetration: PerImpact
    force: PerImpact
    closest_turn: Scalar
    end: Scalar


class _Turns(NamedTuple):
    """The highest turn of each track within each step, and whether there is one."""

    exists: Bool[Array, "steps tracks"]
    level: Float[Array, "steps tracks"]


class _Part(NamedTuple):
    """A part of a step, and the level that turns in it."""

    row: Int[Array, ""]
    level: Int[Array, ""]
    bracket: Bracket


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
        return Extremes(nothing, nothing, far, far)
    log = record.log
    tracks = tracks_of(model, record)
    nodes = nodes_of(step, model, path, record, tracks)
    rates, turns = nodes.rate, _turns(step, model, path, record, tracks, nodes)
    start, end = _at_ends(model, path, record, tracks)

    flying = tracks.followed & (log.mode.phase == Phase.FLIGHT)[:, None]
    stands = (rates[..., -2] > 0) & _stands(model, record)[:, None]
    turned = jnp.minimum(
        jnp.min(jnp.where(flying & turns.exists, -turns.level, far)),
        jnp.min(jnp.where(flying & stands, -end, far)),
    )
    final = (log.event == NO_EVENT) & (log.h >= record.end.t - log.t)
    approaches = (rates[..., -1] > 0) & final[:, None]
    ended = jnp.min(jnp.where(flying & approaches, -end, far))
    if not is_compliant(model):
        return Extremes(nothing, nothing, turned, ended)
    touching = log.taken & (log.mode.phase == Phase.CONTACT) & (slots >= 0)
    highest = [
        _highest(
            [
                (touching, start[:, quantity]),
                (touching, end[:, quantity]),
                (touching & turns.exists[:, quantity], turns.level[:, quantity]),
            ],
            slots,
            count,
        )
        for quantity in (_PENETRATION, _FORCE)
    ]
    return Extremes(highest[_PENETRATION], highest[_FORCE], turned, ended)


def _stands(model: ImpactOscillator, record: Record) -> Bool[Array, " steps"]:
    """Whether a step ends because the mass comes to a stand."""
    stands = jnp.zeros_like(record.log.taken)
    for index, transition in enumerate(Automaton(model).transitions):
        if isinstance(transition, Sliding):
            stands = stands | (record.log.event == index)
    return stands


def _at_ends(
    model: ImpactOscillator, path: Path, record: Record, tracks: Tracks
) -> tuple[Float[Array, "steps tracks"], Float[Array, "steps tracks"]]:
    """The levels at the ends of each step, with derivatives.

    Where a stop is touched or left the force may have an infinite slope; nothing is highest there
    that is not so at the start of a step.
    """
    log = record.log
    open_ended = (log.event == NO_EVENT) | _stands(model, record)
    harmless = jax.tree.map(lambda column: jnp.broadcast_to(column[0], column.shape), path.y)
    starts = log.taken & (log.mode.phase == Phase.CONTACT)
    start = jax.tree.map(lambda a, b: jnp.where(starts, a, b), path.y, harmless)
    end = jax.tree.map(lambda a, b: jnp.where(open_ended & log.taken, a, b), path.end, start)
    both = (jax.vmap(functools.partial(heights, model))(y) for y in (start, end))
    start, end = (jnp.take_along_axis(levels, tracks.level, axis=1) for levels in both)
    return start, end


def _turns(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    tracks: Tracks,
    nodes: Nodes,
) -> _Turns:
    """The turns of all tracks; those that exist are sought first, all others cost nothing."""
    share, heights, rates = nodes
    # Where an event ends the step a force may be zero because the contact has ended.
    ends = (record.log.event != NO_EVENT)[:, None] & (rates[..., -1] == 0)
    falls = (rates[..., :-1] > 0) & (rates[..., 1:] <= 0) & tracks.followed[..., None]
    falls = falls.at[..., -1].set(falls[..., -1] & ~ends)
    height = jnp.where(falls, jnp.maximum(heights[..., :-1], heights[..., 1:]), -jnp.inf)
    exists = jnp.any(falls, axis=-1)
    part = jnp.where(exists, jnp.argmax(height, axis=-1), 0)[..., None]
    (begin, low), (end, high) = (
        [jnp.take_along_axis(x, part + side, axis=-1).reshape(-1) for x in (share, rates)]
        for side in (0, 1)
    )
    shape, flat = exists.shape, exists.reshape(-1)
    place = jnp.cumsum(flat, dtype=jnp.int32) - 1
    number = jnp.arange(flat.shape[0], dtype=jnp.int32)
    slot = jnp.zeros_like(number).at[jnp.where(flat, place, flat.shape[0])].set(number, mode="drop")
    row = slot // shape[1]
    h = jnp.where(flat[slot], jax.lax.stop_gradient(path.h)[row], 0.0)
    bracket = Bracket(begin[slot] * h, low[slot], end[slot] * h, high[slot])
    sought = _Part(row, tracks.level.reshape(-1)[slot], bracket)
    found = _at_turns(step, model, path, record, sought, number <= place[-1])
    return _Turns(exists, found[jnp.maximum(place, 0)].reshape(shape))


def _at_turns(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    sought: _Part,
    exists: Bool[Array, " slots"],
) -> Float[Array, " slots"]:
    """The levels where they turn."""

    def level(s: Scalar, parameters: PyTree) -> tuple[Scalar, Scalar]:
        model, (t, mode, expansion), which, exists = parameters
        y = step.evaluate(Automaton(model), mode, expansion, s, jnp.zeros_like(s))
        value, rate, _ = (x[which] for x in levels_of(model, t + s, y, mode))
        return value, jnp.where(exists, rate, -s)  # harmless where nothing turns

    def peak(slot: PyTree) -> Scalar:
        place, which, bracket, exists = slot
        parameters = model, place, which, exists
        turn = falling_zero(lambda s, parameters: level(s, parameters)[1], bracket, parameters)
        return level(turn, parameters)[0]

    columns = path.t, record.log.mode, path.expansion
    places = jax.tree.map(lambda column: column[sought.row], columns)
    slots, used = exists.shape[0], record.passes * (exists.shape[0] // path.t.shape[0])
    every = places, sought.level, sought.bracket, exists
    return map_rows(peak, every, used, min(CHUNK, slots))


def _highest(
    candidates: list[tuple[Bool[Array, " steps"], PerStep]], slots: Slots, count: int
) -> PerImpact:
    """The highest of some candidates of each slot; zero without one."""
    among = jnp.concatenate([among for among, _ in candidates])
    value = jnp.concatenate([value for _, value in candidates])
    slots = jnp.where(among, jnp.tile(slots, len(candidates)), count)
    score = jax.lax.stop_gradient(value)
    best = jnp.full(count, -jnp.inf, score.dtype).at[slots].max(score, mode="drop")
    wins = among & (score == best.at[slots].get(mode="fill", fill_value=jnp.inf))
    numbers = jnp.arange(score.shape[0], dtype=jnp.int32)
    row = jnp.zeros(count, jnp.int32).at[jnp.where(wins, slots, count)].set(numbers, mode="drop")
    return jnp.where(jnp.isfinite(best), value[row], 0.0)
