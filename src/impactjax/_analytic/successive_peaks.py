"""Restitution from two successive peaks."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._analytic.exact_flight import ExactFlight
from impactjax._analytic.flight import AbstractFlight
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import as_parameter
from impactjax._types import Ratio, Speed


class Rebound(eqx.Module):
    """The speeds of an impact.

    - `approach_speed`: before it [m/s].
    - `separation_speed`: after it [m/s].
    """

    approach_speed: Speed
    separation_speed: Speed

    @property
    def restitution(self) -> Ratio:
        """Coefficient of restitution: separation speed over approach speed [1]."""
        return self.separation_speed / self.approach_speed


def successive_peaks(
    oscillator: AbstractOscillator,
    first: ArrayLike,
    second: ArrayLike,
    *,
    flight: AbstractFlight = ExactFlight(),
) -> Rebound:
    """Speeds and restitution of the impact between two successive peaks of a record.

    The fall from the first peak ends with the approach speed; the separation speed is that whose
    flight rises to the second. The contact between them may be of any kind and take its time: the
    speeds are those at the stop. Differentiable in everything.

    **Arguments:**

    - `oscillator`: what flies, on a base at rest; its stop is below.
    - `first`, `second`: the largest coordinate before and after the impact, one or many of each
      [rad] or [m].
    - `flight`: how speeds follow from peaks.
    """
    first, second = jnp.broadcast_arrays(as_parameter(first), as_parameter(second))
    peaks = jnp.stack([first, second], axis=-1)
    speeds = flight.speed(oscillator, peaks, jnp.array([1.0, -1.0], peaks.dtype))
    return Rebound(speeds[..., 0], speeds[..., 1])
