"""Jumps of velocity."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._simulate.automaton import NO_EVENT
from impactjax._simulate.lane import Log
from impactjax._simulate.replay import Path


class Jumps(eqx.Module):
    """Jumps of velocity: at the impacts on a rigid stop, where a summed chatter ends in rest, and
    where a mass with a factor leaves a compliant stop.

    - `time`: in order [s].
    - `size`: velocity after minus velocity before [rad/s] or [m/s]; zero in unused rows.

    The impacts of a summed chatter are not among them.
    """

    time: Float[Array, "... jumps"]
    size: Float[Array, "... jumps"]


def jumps_of(path: Path, log: Log, max_jumps: int) -> Jumps:
    """The first `max_jumps` jumps of a lane: a step starts with another velocity than that with
    which the step before ended.
    """
    time, change = path.t[1:], path.y.velocity[1:] - path.end.velocity[:-1]
    jumps = (log.event[:-1] != NO_EVENT) & (change != 0)
    row = jnp.where(jumps, jnp.cumsum(jumps, dtype=jnp.int32) - 1, max_jumps)
    none = jnp.zeros(max_jumps, time.dtype)
    return Jumps(none.at[row].add(time, mode="drop"), none.at[row].add(change, mode="drop"))
