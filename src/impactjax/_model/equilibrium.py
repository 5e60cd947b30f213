"""Equilibrium from which the angle of a pendulum is counted."""

import abc

import equinox as eqx
import jax.numpy as jnp

from impactjax._shown import with_numbers
from impactjax._types import Coordinate, Ratio


class AbstractEquilibrium(eqx.Module):
    """Position at which a pendulum's angle is zero."""

    @abc.abstractmethod
    def pull(self, position: Coordinate) -> Ratio:
        """Acceleration by gravity towards the equilibrium, divided by ω_n² [1]."""

    __repr__ = with_numbers


class Hanging(AbstractEquilibrium):
    """Equilibrium below the pivot, to which gravity returns the pendulum: sin θ."""

    def pull(self, position: Coordinate) -> Ratio:
        return jnp.sin(position)


class Inverted(AbstractEquilibrium):
    """Equilibrium above the pivot, from which gravity drives the pendulum away: −sin θ."""

    def pull(self, position: Coordinate) -> Ratio:
        return -jnp.sin(position)
