"""Restitution from two successive peaks."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._analytic.exact_flight import ExactFlight
from impactjax._analytic.flight import AbstractFlight
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import as_parameter
from impactjax._types import Numbers, Ratio, Speed


class Rebound(eqx.Module):
    """Speeds of an impact.

    - `approach_speed`: speed before it [m/s].
    - `separation_speed`: speed after it [m/s].
    """

    approach_speed: Speed
    separation_speed: Speed

    @property
    def restitution(self) -> Ratio:
        """Coefficient of restitution: separation speed over approach speed [1]."""
        return self.separation_speed / self.approach_speed


def successive_peaks(
    oscillator: AbstractOscillator,
    first: Numbers,
    second: Numbers,
    *,
    flight: AbstractFlight = ExactFlight(),
) -> Rebound:
    """Speeds and restitution of the impact between two successive peaks of a record.

    The approach speed is that at the end of the fall from the first peak. A flight that begins with
    the separation speed rises to the second peak. The contact may be of any kind and duration.
    Differentiable in all arguments.

    **Arguments:**

    - `oscillator`: equation of motion, on a base at rest; its stop is below.
    - `first`, `second`: largest coordinates before and after the impact, one or many of each [rad]
      or [m].
    - `flight`: relation between peaks and speeds.
    """
    first, second = jnp.broadcast_arrays(as_parameter(first), as_parameter(second))
    peaks = jnp.stack([first, second], axis=-1)
    speeds = flight.speed(oscillator, peaks, jnp.array([1.0, -1.0], peaks.dtype))
    return Rebound(speeds[..., 0], speeds[..., 1])
