"""Where a motion turns within a step, and where a contact force peaks.

Both are zeros of a rate that falls through zero inside a known step: that of the penetration, and
that of the force. One such step is chosen an impact, and one a stop before which the mass turned in
flight, and the zero is found in it.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

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


class _Bracket(NamedTuple):
    low: Scalar
    at_low: Scalar
    high: Scalar
    at_high: Scalar


class _Place(NamedTuple):
    """A step, and which level turns in it."""

    t: Scalar
    y: State
    mode: Mode
    expansion: PyTree
    h: Scalar
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
    levels = jax.jit(functools.partial(_levels, model))  # so that it is traced once
    start, rate = jax.vmap(levels)(path.t, path.y, log.mode)
    end, end_rate = jax.vmap(levels)(path.t + path.h, path.end, log.mode)
    turns, highest = (rate > 0) & (end_rate <= 0), jnp.maximum(start, end)

    @jax.jit
    def peak(place: _Place) -> Scalar:
        def own(s: Scalar) -> tuple[Scalar, Scalar]:
            y = step.evaluate(Automaton(model), place.mode, place.expansion, s)
            of_all = levels(place.t + s, y, place.mode)
            value, rate = (jnp.sum(x, where=place.which) for x in of_all)
            return value, rate

        return own(falling_zero(lambda s: own(s)[1], place.h))[0]

    def at_turn(rows: Array, quantity: int, stop: Array) -> Array:
        """A level where it turns within each of some steps."""
        columns = path.t, path.y, log.mode, path.expansion, path.h
        chosen = jax.tree.map(lambda column: column[rows], columns)
        number = jnp.arange(2 * stops, dtype=stop.dtype).reshape(2, stops)
        which = number == quantity * stops + stop[:, None, None]
        return map_rows(peak, _Place(*chosen, which=which), record.passes, CHUNK)

    touching = log.taken & (log.mode.phase == Phase.CONTACT)
    slots = jnp.where(touching & (slots >= 0), slots, count)
    first, begins = _choose(touching, -path.t, slots, count)

    def of_impacts(quantity: int) -> PerImpact:
        def own(x: Array) -> Array:
            return jnp.take_along_axis(x[:, quantity], log.mode.stop[:, None], axis=1)[:, 0]

        row, exists = _choose(own(turns), own(highest), slots, count)
        inside = at_turn(row, quantity, log.mode.stop[row])
        at_touch = jnp.where(begins, own(start)[first], 0.0)
        return jnp.where(exists, jnp.maximum(inside, at_touch), at_touch)

    flying = log.taken & (log.mode.phase == Phase.FLIGHT)

    def miss(stop: int) -> Scalar:
        turned = flying & turns[:, _PENETRATION, stop]
        row, exists = _choose(turned, highest[:, _PENETRATION, stop], jnp.zeros_like(slots), 1)
        inside = at_turn(row, _PENETRATION, jnp.full_like(row, stop))
        return jnp.where(exists, -inside, jnp.inf)[0]

    compliant = any(isinstance(wall.stop.law, AbstractForceLaw) for wall in walls(model))
    return Extremes(
        of_impacts(_PENETRATION) if compliant else nothing,
        of_impacts(_FORCE) if compliant else nothing,
        functools.reduce(jnp.minimum, [miss(stop) for stop in range(stops)]),
    )


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
