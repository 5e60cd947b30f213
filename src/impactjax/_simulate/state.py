"""The state of one lane: its continuous part `State` and its discrete part `Mode`."""

import enum
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from impactjax._types import Code, Flag, Scalar


class State(NamedTuple):
    """The continuous state: coordinate, its rate, and each stop's internal state."""

    position: Scalar
    velocity: Scalar
    internal: PyTree[Float[Array, ""]] = ()


class Phase(enum.IntEnum):
    """Phase of the motion, which decides the flow."""

    FLIGHT = 0  # no contact
    CONTACT = 1  # a compliant stop pushes
    DETACHED = 2  # inside a compliant stop's indentation, without force
    CHATTER = 3  # the rest of an endless series of impacts, in closed form
    REST = 4  # lying on a rigid stop
    SETTLED = 5  # lying in a compliant stop


class Mode(NamedTuple):
    """The discrete state."""

    phase: Code  # a Phase
    stop: Code  # index of the stop in contact; 0 in flight
    friction: Code  # sign of the sliding velocity; 0 where dry friction holds the mass

    def at(self, phase: Phase, stop: int) -> Flag:
        """True in `phase` at the stop with the number `stop`."""
        return (self.phase == phase) & (self.stop == stop)


def mode(phase: Phase, stop: int, friction: Code) -> Mode:
    """A mode from plain numbers."""
    return Mode(jnp.int32(phase), jnp.int32(stop), friction)
