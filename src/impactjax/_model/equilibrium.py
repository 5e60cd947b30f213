"""From which equilibrium the angle of a pendulum is counted."""

import abc

import equinox as eqx
import jax.numpy as jnp

from impactjax._shown import with_numbers
from impactjax._types import Coordinate, Ratio


class AbstractEquilibrium(eqx.Module):
    """Where a pendulum's angle is zero."""

    @abc.abstractmethod
    def pull(self, position: Coordinate) -> Ratio:
        """What gravity does, in units of ω_n²: the acceleration towards the equilibrium [1]."""

    __repr__ = with_numbers


class Hanging(AbstractEquilibrium):
    """Below the pivot; gravity brings the pendulum back: sin θ."""

    def pull(self, position: Coordinate) -> Ratio:
        return jnp.sin(position)


class Inverted(AbstractEquilibrium):
    """Above the pivot; gravity drives the pendulum away: −sin θ."""

    def pull(self, position: Coordinate) -> Ratio:
        return -jnp.sin(position)
