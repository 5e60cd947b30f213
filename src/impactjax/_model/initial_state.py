"""Initial state of a simulation."""

import math

import equinox as eqx
import numpy as np
from jax.core import Tracer

from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import as_parameter, parameter
from impactjax._shown import with_numbers
from impactjax._types import Coordinate, CoordinateRate


class InitialState(eqx.Module):
    """Initial state of a simulation.

    **Arguments:**

    - `position`: coordinate [rad] or [m].
    - `velocity`: its rate [rad/s] or [m/s].
    """

    position: Coordinate = eqx.field(converter=as_parameter, metadata=parameter("rad or m"))
    velocity: CoordinateRate = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s or m/s"), default=0.0
    )

    __repr__ = with_numbers


def check_angle(oscillator: AbstractOscillator, initial: InitialState) -> None:
    """Raises `ValueError` for a known initial angle above 2π, which looks like degrees."""
    if not oscillator.is_angle() or isinstance(initial.position, Tracer):
        return
    farthest = float(np.max(np.abs(np.asarray(initial.position)), initial=0.0))
    if math.isfinite(farthest) and farthest > 2 * math.pi:
        raise ValueError(
            f"An initial angle of {farthest:g} rad is more than a turn; are degrees meant? "
            "`numpy.deg2rad` turns them into radians."
        )
