"""Magnification of errors by impacts that nearly graze a stop."""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.flow import free_acceleration, walls
from impactjax._simulate.lane import Record
from impactjax._simulate.replay import Path
from impactjax._simulate.state import Phase
from impactjax._types import Scalar

PerImpact = Float[Array, " impacts"]
PerStep = Float[Array, " steps"]


def magnification(
    model: ImpactOscillator,
    path: Path,
    record: Record,
    begins: Bool[Array, " steps"],
    number: Int[Array, " steps"],
    restitution: PerImpact,
    duration: PerImpact,
    closest_turn: Scalar,
) -> Scalar:
    """The largest factor by which an impact of a run, or a near miss, magnifies an error.

    An impact at speed v under the acceleration a turns a relative error of position before it into
    a relative error of velocity after it, larger by the factor (1 + r) a A / (v V), with the width
    A of the flight and its greatest speed V. A contact of duration T counts as an impact at a speed
    of at least a T / π, a miss by the distance m as an impact at √(2 a m).

    Source: Nordmark, J. Sound Vib. 145, 279 (1991).

    **Arguments:**

    - `begins`: mask of the steps that end with an impact.
    - `number`: number of the impact at the end of each step, or of the last one before.
    - `restitution`, `duration`: restitution and duration of each impact.
    - `closest_turn`: least distance of a turn in flight from a stop [m].
    """
    one = jnp.ones_like(path.t[0])
    if not walls(model):
        return one
    model, path, r, duration = jax.lax.stop_gradient((model, path, restitution, duration))
    flying = record.log.taken & (record.log.mode.phase == Phase.FLIGHT)
    steps, impacts = path.t.shape[0], r.shape[0]
    flight = jnp.where(flying, jnp.where(begins, number, number + 1), steps)

    def highest(start: PerStep, end: PerStep) -> PerStep:
        """The greatest value in the flight that each step belongs to."""
        values = jnp.maximum(start, end)
        of_flight = jnp.full(steps, -jnp.inf, values.dtype).at[flight].max(values, mode="drop")
        return of_flight.at[flight].get(mode="fill", fill_value=0)

    (x0, v0, _), (x1, v1, _) = path.y, path.end
    tops = jnp.stack([x0, -x0, jnp.abs(v0)]), jnp.stack([x1, -x1, jnp.abs(v1)])
    above, below, fastest = jax.vmap(highest)(*tops)
    width = above + below
    pull = jnp.abs(jax.vmap(partial(free_acceleration, model))(path.t + path.h, path.end))
    lasts, r = (x.at[number].get(mode="fill", fill_value=0) for x in (duration, r))
    speed = fastest * jnp.hypot(v1, pull * lasts / jnp.pi)
    counts = begins & flying & (number < impacts) & (speed > 0)
    factor = (1 + r) * pull * width / jnp.where(counts, speed, 1.0)
    of_impacts = jnp.max(jnp.where(counts, factor, 1.0))
    miss = jax.lax.stop_gradient(closest_turn) / model.oscillator.lever()
    of_miss = jnp.sqrt(jnp.max(jnp.where(flying, width, 0)) / jnp.maximum(miss, _tiny(one)))
    return jnp.maximum(one, jnp.maximum(of_impacts, of_miss))


def _tiny(like: Scalar) -> float:
    return float(jnp.finfo(like.dtype).tiny)
