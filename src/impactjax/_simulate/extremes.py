"""Extremes of a simulated motion: deepest penetration, peak force and nearest miss.

All are maxima of a *level* along the steps: the penetration of a stop (negative in flight), or its
contact force. A maximum is a *turn*, where the rate of the level falls through zero inside a step,
or an end of a step, since a step may end just where the mass turns. In flight the penetrations of
all stops are followed; in contact penetration and force of the stop in contact. Each step is
divided into parts, since two turns in one part would hide each other.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from impactjax._hybrid.chunks import CHUNK, map_some
from impactjax._hybrid.varying import alike
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.root import at_turn
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.chandrupatla import Bracket, falling_zero
from impactjax._simulate.flow import has_resistance, walls
from impactjax._simulate.lane import Record
from impactjax._simulate.levels import chosen, heights, is_compliant, levels_of
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
    """Extremes of a run.

    - `penetration`, `force`: deepest penetration [m] and peak force [N] of each impact; zero at a
      rigid stop.
    - `closest_turn`: least distance from a stop at which the mass turned in flight [m]; infinite
      without such a turn.
    - `end`: distance from a stop at the end of a run that ends on the way to it [m]; else infinite.
    """

    penetration: PerImpact
    force: PerImpact
    closest_turn: Scalar
    end: Scalar


class _Turns(NamedTuple):
    """The highest turn of each track within each step, if there is one."""

    exists: Bool[Array, "steps tracks"]
    level: Float[Array, "steps tracks"]


class _Falls(NamedTuple):
    """Brackets of the turns of a track within a step.

    - `s`, `rate`: nodes, as times since the start of the step, and rates there.
    - `exists`: mask of the parts between two nodes in which the rate falls through zero.
    """

    s: Float[Array, "... nodes"]
    rate: Float[Array, "... nodes"]
    exists: Bool[Array, "... parts"]


class _Highest(NamedTuple):
    """The highest turn in all parts up to `part`."""

    part: Int[Array, ""]
    s: Scalar
    level: Scalar


def extremes(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    slots: Slots,
    count: int,
) -> Extremes:
    """The extremes of a run of `count` impacts; `slots` has the number of each step's impact.

    Three questions share one search for turns:

    - nearest miss: the highest turn of all tracks in flight, or a stand before a stop, or the end
      of the run on the way to a stop
    - deepest penetration of an impact: the highest of the penetrations at the starts, ends and
      turns of the steps in its contact
    - peak force of an impact: likewise of the forces
    """
    nothing = without_extremes(count, path.t[0])
    if not walls(model):
        return nothing
    log = record.log
    tracks = tracks_of(model, record)
    nodes = nodes_of(step, model, path, record, tracks)
    turns = _turns(step, model, path, record, tracks, nodes)
    start, end = _at_ends(model, path, record, tracks)
    closest = _misses(model, record, tracks, nodes, turns, end)
    if not is_compliant(model):
        return Extremes(nothing.penetration, nothing.force, *closest)
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
    return Extremes(highest[_PENETRATION], highest[_FORCE], *closest)


def without_extremes(count: int, like: Scalar) -> Extremes:
    """The extremes of a run of `count` impacts that has none, with the type of `like`."""
    nothing, far = jnp.zeros(count, like.dtype), jnp.full_like(like, jnp.inf)
    return Extremes(nothing, nothing, far, far)


def _misses(
    model: ImpactOscillator,
    record: Record,
    tracks: Tracks,
    nodes: Nodes,
    turns: _Turns,
    end: Float[Array, "steps tracks"],
) -> tuple[Scalar, Scalar]:
    """Least distances from a stop: at a turn or a stand in flight, and at the end of the run."""
    log, rates, far = record.log, nodes.rate, jnp.full_like(record.t1, jnp.inf)
    flying = tracks.followed & (log.mode.phase == Phase.FLIGHT)[:, None]
    turned = jnp.min(jnp.where(flying & turns.exists, -turns.level, far))
    if has_resistance(model):
        stands = (rates[..., -2] > 0) & _stands(model, record)[:, None]
        turned = jnp.minimum(turned, jnp.min(jnp.where(flying & stands, -end, far)))
    final = (log.event == NO_EVENT) & (log.h >= record.t1 - log.t)
    approaches = (rates[..., -1] > 0) & final[:, None]
    return turned, jnp.min(jnp.where(flying & approaches, -end, far))


def _stands(model: ImpactOscillator, record: Record) -> Bool[Array, " steps"]:
    """Mask of the steps that end because the velocity becomes zero."""
    stands = jnp.zeros_like(record.log.taken)
    for index, transition in enumerate(Automaton(model).transitions):
        if isinstance(transition, Sliding):
            stands = stands | (record.log.event == index)
    return stands


def _at_ends(
    model: ImpactOscillator, path: Path, record: Record, tracks: Tracks
) -> tuple[Float[Array, "steps tracks"], Float[Array, "steps tracks"]]:
    """The levels at the ends of each step, with derivatives.

    The derivative of a force may be infinite where contact begins or ends. Such ends are replaced
    by the start of the step, which cannot hide a maximum.
    """
    log = record.log
    open_ended = (log.event == NO_EVENT) | _stands(model, record)
    harmless = jax.tree.map(lambda column: jnp.broadcast_to(column[0], column.shape), path.y)
    starts = log.taken & (log.mode.phase == Phase.CONTACT)
    start = jax.tree.map(lambda a, b: jnp.where(starts, a, b), path.y, harmless)
    end = jax.tree.map(lambda a, b: jnp.where(open_ended & log.taken, a, b), path.end, start)
    both = (jax.vmap(functools.partial(heights, model))(y) for y in (start, end))
    start, end = (chosen(levels[:, None], tracks.level) for levels in both)
    return start, end


def _turns(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    tracks: Tracks,
    nodes: Nodes,
) -> _Turns:
    """The highest turn of each track in each step, with derivatives by the implicit function
    theorem. Steps without a turn are not searched.
    """
    rate = nodes.rate
    # At an event that ends the step, the rate of a force may be zero because contact has ended.
    ends = (record.log.event != NO_EVENT)[:, None] & (rate[..., -1] == 0)
    falls = (rate[..., :-1] > 0) & (rate[..., 1:] <= 0) & tracks.followed[..., None]
    falls = falls.at[..., -1].set(falls[..., -1] & ~ends)
    exists = jnp.any(falls, axis=-1)

    def level(row: PyTree) -> Scalar:
        places, falls = row
        at = model, *places, jnp.any(falls.exists)
        turn = _highest_turn(step, falls, at)
        return at_turn(functools.partial(_height, step), functools.partial(_rate, step), turn, at)

    s = nodes.share * jax.lax.stop_gradient(path.h)[:, None, None]
    shape, columns = exists.shape, (path.t, record.log.mode, path.expansion)
    number = jnp.arange(shape[0] * shape[1], dtype=jnp.int32)
    rows = _Falls(s, rate, falls)
    flat = jax.tree.map(lambda x: x.reshape(-1, x.shape[-1]), rows)
    places = jax.tree.map(lambda x: x[number // shape[1]], columns)
    levels = map_some(level, ((places, tracks.level.reshape(-1)), flat), exists.reshape(-1), CHUNK)
    return _Turns(exists, levels.reshape(shape))


def _highest_turn(step: AbstractStep, falls: _Falls, at: PyTree) -> Scalar:
    """Time of the highest turn within a step, without derivatives. It visits one bracketed part
    after the other.
    """
    (s, rate, exists), at = jax.lax.stop_gradient((falls, at))
    number = jnp.arange(exists.shape[0], dtype=jnp.int32)

    def left(best: _Highest) -> Bool[Array, " parts"]:
        return exists & (number > best.part)

    def after_next(best: _Highest) -> _Highest:
        part = jnp.argmax(left(best)).astype(jnp.int32)
        bracket = Bracket(s[part], rate[part], s[part + 1], rate[part + 1])
        turn = falling_zero(functools.partial(_rate, step), bracket, at)
        level = _height(step, turn, at)
        higher = level > best.level
        either = jnp.where(higher, turn, best.s), jnp.where(higher, level, best.level)
        return alike(_Highest(part, *either), everything)

    everything = falls, at
    begin = alike(_Highest(jnp.int32(-1), s[0], jnp.full_like(s[0], -jnp.inf)), everything)
    return jax.lax.while_loop(lambda best: jnp.any(left(best)), after_next, begin).s


def _level(step: AbstractStep, s: Scalar, at: PyTree) -> tuple[Scalar, Scalar]:
    """A level within a step, and its rate."""
    model, (t, mode, expansion), which, exists = at
    y = step.evaluate(Automaton(model), mode, expansion, s, jnp.zeros_like(s))
    value, rate = (chosen(x, which) for x in levels_of(model, t + s, y, mode))
    return value, jnp.where(exists, rate, -s)  # any falling rate, without a turn


def _height(step: AbstractStep, s: Scalar, at: PyTree) -> Scalar:
    return _level(step, s, at)[0]


def _rate(step: AbstractStep, s: Scalar, at: PyTree) -> Scalar:
    return _level(step, s, at)[1]


def _highest(
    candidates: list[tuple[Bool[Array, " steps"], PerStep]], slots: Slots, count: int
) -> PerImpact:
    """The highest of some candidates for each slot; zero without a candidate."""
    among = jnp.concatenate([among for among, _ in candidates])
    value = jnp.concatenate([value for _, value in candidates])
    slots = jnp.where(among, jnp.tile(slots, len(candidates)), count)
    score = jax.lax.stop_gradient(value)
    best = jnp.full(count, -jnp.inf, score.dtype).at[slots].max(score, mode="drop")
    wins = among & (score == best.at[slots].get(mode="fill", fill_value=jnp.inf))
    numbers = jnp.arange(score.shape[0], dtype=jnp.int32)
    row = jnp.zeros(count, jnp.int32).at[jnp.where(wins, slots, count)].set(numbers, mode="drop")
    return jnp.where(jnp.isfinite(best), value[row], 0.0)
