"""Kinks of a motion between its samples."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact, Int

from impactjax._simulate.jumps import Jumps
from impactjax._types import Samples


class Kinks(NamedTuple):
    """Jumps of a rate, each in an interval between two samples.

    - `interval`: its number; the number of intervals for a jump that lies in none.
    - `after`: time from the jump to the end of the interval [s].
    - `size`: of the jump.
    """

    interval: Int[Array, " jumps"]
    after: Float[Array, " jumps"]
    size: Float[Array, " jumps"]

    def summed(self, each: Inexact[Array, " jumps"], ts: Samples) -> Inexact[Array, " intervals"]:
        """Sums over the jumps in each interval."""
        none = jnp.zeros(ts.shape[0] - 1, each.dtype)
        return none.at[self.interval].add(each, mode="drop")


def kinks_of(jumps: Jumps | None, ts: Samples) -> Kinks:
    """The kinks between samples at the times `ts`. A jump at a sample lies before it, since samples
    show the state after an impact.
    """
    if jumps is None:
        none = jnp.zeros(0, ts.dtype)
        return Kinks(jnp.zeros(0, int), none, none)
    intervals = ts.shape[0] - 1
    end = jnp.searchsorted(ts, jumps.time, side="left")
    inside = (end > 0) & (end <= intervals)
    after = jnp.where(inside, ts[jnp.minimum(end, intervals)] - jumps.time, 0.0)
    return Kinks(jnp.where(inside, end - 1, intervals), after, jumps.size)
