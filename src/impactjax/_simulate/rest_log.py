"""The rest log: periods of rest on a rigid stop."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._simulate.lane import Log
from impactjax._simulate.replay import Path
from impactjax._simulate.state import Phase

Steps = Bool[Array, " steps"]


class RestLog(eqx.Module):
    """One row for each rest, in order of time; rows from `count` on are zero.

    - `begin`: time at which the mass comes to rest, after an infinite series of impacts [s].
    - `end`: time at which it is released, or the run ends [s].
    - `stop`: 0 for the lower stop of a model, 1 for the upper one, if it has both.
    - `released`: true if the rest ended before the run.
    """

    count: Int[Array, "..."]
    begin: Float[Array, "... rests"]
    end: Float[Array, "... rests"]
    stop: Int[Array, "... rests"]
    released: Bool[Array, "... rests"]


class Rests(NamedTuple):
    """The rests of a lane, and their number."""

    log: RestLog
    total: Int[Array, ""]


def rests_of(path: Path, log: Log, max_rests: int) -> Rests:
    """The rest log of a lane, with `max_rests` rows."""
    rests = log.taken & (log.mode.phase == Phase.REST)
    before = _just_before(rests, log.taken)
    after = _just_before(rests[::-1], log.taken[::-1])[::-1]
    number = jnp.cumsum(rests & ~before, dtype=jnp.int32) - 1
    opened = jnp.where(rests & ~before, number, max_rests)
    closed = jnp.where(rests & ~after, number, max_rests)

    def gather(values: Array, rows: Array) -> Array:
        return jnp.zeros(max_rests, values.dtype).at[rows].add(values, mode="drop")

    released = gather((log.event >= 0).astype(jnp.int32), closed)
    total = number[-1] + 1
    rests_log = RestLog(
        count=jnp.minimum(total, max_rests),
        begin=gather(path.t, opened),
        end=gather(path.t + path.h, closed),
        stop=gather(log.mode.stop, opened),
        released=released > 0,
    )
    return Rests(rests_log, total)


def _just_before(rests: Steps, taken: Steps) -> Steps:
    """Mask of the rows whose last taken step before them was at rest."""
    numbers = jnp.where(taken, jnp.arange(taken.shape[0]), -1)
    latest = jnp.concatenate([jnp.full(1, -1), jax.lax.cummax(numbers)[:-1]])
    return (latest >= 0) & rests[latest]
