"""The two kinds of contact law: a jump map of the velocity, or a force."""

import abc
from typing import TYPE_CHECKING, cast

import equinox as eqx
from jaxtyping import Array, Float, PyTree

from impactjax._model.separation import AbstractSeparation
from impactjax._parameter import Requirement, raise_if_violated, range_requirements
from impactjax._shown import with_numbers
from impactjax._types import Force, Length, Mass, Ratio, Speed

Internal = PyTree[Float[Array, "..."]]  # a force law's own state


class AbstractLaw(eqx.Module):
    """Contact at a stop: a jump of the velocity, or a force."""

    @abc.abstractmethod
    def is_rigid(self) -> bool:
        """True if the contact takes no time."""

    def requirements(self) -> list[Requirement]:
        """Conditions on the parameters."""
        return range_requirements(self)

    def __check_init__(self) -> None:
        raise_if_violated(self, self.requirements())

    __repr__ = with_numbers


class AbstractImpactLaw(AbstractLaw):
    """A rigid stop: at the moment of impact v⁺ = −r v⁻, with r = restitution(|v⁻|)."""

    @abc.abstractmethod
    def restitution(self, speed: Speed) -> Ratio:
        """Coefficient of restitution r at an approach speed [m/s]."""

    def is_rigid(self) -> bool:
        return True


class AbstractForceLaw(AbstractLaw):
    """A compliant stop: a force from penetration, its rate, and an internal state of the law.

    The contact begins at zero penetration and ends by the rule `separation`.
    """

    if TYPE_CHECKING:  # a checker takes a field here for the first argument of every subclass
        separation = cast(AbstractSeparation, None)
    else:
        separation: eqx.AbstractVar[AbstractSeparation]

    @abc.abstractmethod
    def touch(self, speed: Speed, mass: Mass) -> Internal:
        """The internal state at the beginning of contact at an approach speed; `()` if there is
        none.

        NaN means that the law is not valid at that speed: the run then ends with
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
        """The empty internal state."""
        del speed, mass
        return ()

    def internal_rate(
        self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass
    ) -> tuple[()]:
        """The rate of the empty internal state."""
        del penetration, rate, mass
        return internal
