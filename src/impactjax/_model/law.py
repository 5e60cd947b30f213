"""The two kinds of contact law, divided by their mathematics: a jump map, or a force."""

import abc

import equinox as eqx
from jaxtyping import Array, Float, PyTree

from impactjax._model.separation import AbstractSeparation
from impactjax._parameter import raise_if_violated, range_requirements
from impactjax._shown import with_numbers
from impactjax._types import Force, Length, Mass, Ratio, Speed

Internal = PyTree[Float[Array, "..."]]  # a force law's own state


class AbstractLaw(eqx.Module):
    """Contact at a stop: a jump of the velocity, or a force."""

    @abc.abstractmethod
    def is_rigid(self) -> bool:
        """Whether the contact takes no time."""

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    __repr__ = with_numbers


class AbstractImpactLaw(AbstractLaw):
    """A rigid stop: at the moment of impact v⁺ = −r v⁻, with r = restitution(|v⁻|)."""

    @abc.abstractmethod
    def restitution(self, speed: Speed) -> Ratio:
        """Coefficient of restitution r at an approach speed [m/s]."""

    def is_rigid(self) -> bool:
        return True


class AbstractForceLaw(AbstractLaw):
    """A compliant stop: a force from penetration, its rate, and a state of the law's own.

    The contact begins at zero penetration and ends where `separation` says.
    """

    separation: eqx.AbstractVar[AbstractSeparation]

    @abc.abstractmethod
    def touch(self, speed: Speed, mass: Mass) -> Internal:
        """The internal state when contact begins at an approach speed; `()` if there is none.

        NaN says that the law does not hold at that speed: the run ends with
        `RESULTS.restitution_out_of_range`.
        """

    @abc.abstractmethod
    def force(self, penetration: Length, rate: Speed, internal: Internal, mass: Mass) -> Force:
        """Force [N] on the mass, positive when it pushes the mass off the stop."""

    @abc.abstractmethod
    def internal_rate(
        self, penetration: Length, rate: Speed, internal: Internal, mass: Mass
    ) -> Internal:
        """Time derivative of the internal state during contact."""

    def is_rigid(self) -> bool:
        return False


class AbstractMemorylessLaw(AbstractForceLaw):
    """A compliant stop whose force follows from penetration and rate alone."""

    def touch(self, speed: Speed, mass: Mass) -> tuple[()]:
        """No internal state."""
        del speed, mass
        return ()

    def internal_rate(
        self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass
    ) -> tuple[()]:
        """No internal state."""
        del penetration, rate, mass
        return internal
