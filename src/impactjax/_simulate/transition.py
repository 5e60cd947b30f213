"""The interface of transitions: a guard and a jump, which end a mode."""

import abc
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.chatter import Chatter, Scale
from impactjax._simulate.state import Mode, State
from impactjax._types import Flag, Scalar


class Context(NamedTuple):
    """Data of the lane for a jump."""

    scale: Scale
    tolerance: Scalar
    chatter: Chatter


class Jump(NamedTuple):
    """The state and mode after an event."""

    state: State
    mode: Mode
    in_range: Flag  # false if the law is not valid at this speed


class AbstractTransition(eqx.Module):
    """A directed event: it happens when the guard falls through zero, or, without a guard, where a
    step ends.
    """

    guard_stays_zero: ClassVar[bool]
    """True if the guard is zero, up to rounding, just after the event."""

    @abc.abstractmethod
    def guard(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar | None:
        """Positive while the mode lasts; constant where this transition cannot happen; `None` for
        one that has no guard.
        """

    @abc.abstractmethod
    def jump(
        self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode, context: Context
    ) -> Jump:
        """State and mode after the event; smooth in the model, the time and the state."""

    def begins_impact(self, t: Scalar, y: State, mode: Mode) -> Flag:
        """True if the event is the beginning of an impact."""
        del t, y, mode
        return jnp.zeros((), bool)

    def leaves_stop(self, t: Scalar, y: State, mode: Mode) -> Flag:
        """True if the mass leaves a stop by the event."""
        del t, y, mode
        return jnp.zeros((), bool)
