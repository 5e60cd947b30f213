"""Levels that are followed in each step, and the nodes at which they are evaluated."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from numpy.polynomial import chebyshev

from impactjax._hybrid.chunks import FEW_STEPS, map_rows
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.dip import closest_to_zero
from impactjax._simulate.flow import walls
from impactjax._simulate.lane import Record
from impactjax._simulate.levels import Levels, chosen, is_compliant, levels_of
from impactjax._simulate.replay import Path
from impactjax._simulate.state import Mode, Phase
from impactjax._simulate.step import AbstractStep
from impactjax._types import Scalar

_PARTS = 4  # parts of a step, each with at most one turn, except for one with two

# The matrix by which rates at the ends of the parts become the derivatives, by the share of a
# part, of the polynomial through them.
_ENDS = np.linspace(-1.0, 1.0, _PARTS + 1)
_SLOPES = chebyshev.chebval(_ENDS, chebyshev.chebder(np.eye(_PARTS + 1), scl=2 / _PARTS)).T
_DIFFERENTIATION = _SLOPES @ np.linalg.inv(chebyshev.chebvander(_ENDS, _PARTS))

PerNode = Float[Array, "steps tracks nodes"]


class Tracks(NamedTuple):
    """Levels that are followed in each step."""

    level: Int[Array, "steps tracks"]
    followed: Bool[Array, "steps tracks"]


class Nodes(NamedTuple):
    """Nodes in a step, in order, at which a track is evaluated."""

    share: PerNode  # of the step
    rate: PerNode


def tracks_of(model: ImpactOscillator, record: Record) -> Tracks:
    log, stops = record.log, len(walls(model))
    flying = log.taken & (log.mode.phase == Phase.FLIGHT)
    touching = log.taken & (log.mode.phase == Phase.CONTACT)
    levels, followed = [], []
    for track in range(max(stops, 2 if is_compliant(model) else 1)):
        in_flight, in_contact = min(track, stops - 1), log.mode.stop + min(track, 1) * stops
        levels.append(jnp.where(flying, in_flight, in_contact))
        followed.append((flying & (track < stops)) | (touching & (track < 2)))
    return Tracks(jnp.stack(levels, axis=1), jnp.stack(followed, axis=1))


def nodes_of(
    step: AbstractStep, model: ImpactOscillator, path: Path, record: Record, tracks: Tracks
) -> Nodes:
    """The ends of the parts of each step, and one more node between which two turns may be hidden:
    where a rate of one sign comes closest to zero, by the polynomial through all.
    """
    model, path = jax.lax.stop_gradient((model, path))
    ends = jnp.arange(_PARTS + 1, dtype=path.t.dtype) / _PARTS
    shares = jnp.broadcast_to(ends, (path.h.shape[0], _PARTS + 1))
    rates = _within(step, model, path, record, shares)
    rate = chosen(rates[:, None], tracks.level[:, :, None])
    hidden = closest_to_zero(rate, rate @ jnp.asarray(_DIFFERENTIATION.T, rate.dtype))
    more = chosen(_within(step, model, path, record, hidden), tracks.level)
    place = jnp.sum(ends <= hidden[..., None], axis=-1)
    share = jnp.broadcast_to(ends, rate.shape)
    return Nodes(_inserted(share, place, hidden), _inserted(rate, place, more))


def _inserted(
    column: PerNode, place: Int[Array, "steps tracks"], more: Float[Array, "steps tracks"]
) -> Float[Array, "steps tracks nodes+1"]:
    """A column with one more node at some place."""
    before = jnp.concatenate([column, column[..., -1:]], axis=-1)
    after = jnp.concatenate([column[..., :1], column], axis=-1)
    number, place = jnp.arange(before.shape[-1]), place[..., None]
    return jnp.where(number < place, before, jnp.where(number == place, more[..., None], after))


def _within(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    record: Record,
    shares: Float[Array, "steps nodes"],
) -> Float[Array, "steps nodes levels"]:
    """Rates of all levels at some shares of each step."""

    def inside(row: tuple[Path, Mode, Array]) -> Array:
        (t, _, h, _, expansion), mode, shares = row

        def at(s: Scalar) -> Levels:
            y = step.evaluate(Automaton(model), mode, expansion, s, jnp.zeros_like(s))
            return levels_of(model, t + s, y, mode)[1]

        return jax.vmap(at)(shares * h)

    return map_rows(inside, (path, record.log.mode, shares), record.passes, FEW_STEPS)
