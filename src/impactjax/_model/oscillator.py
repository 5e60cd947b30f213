"""What moves between the impacts."""

import abc

import equinox as eqx

from impactjax._parameter import raise_if_violated, range_requirements
from impactjax._types import (
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    Lever,
    Mass,
    Time,
)


class AbstractOscillator(eqx.Module):
    """One coordinate q in free flight: q″ = acceleration(t, q, q′) − resistance(|q′|) sgn q′.

    Your own needs the field and the methods below.
    """

    mass: eqx.AbstractVar[Mass]

    @abc.abstractmethod
    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        """Acceleration in free flight, resistance left out."""

    @abc.abstractmethod
    def resistance(self, speed: CoordinateRate) -> CoordinateAcceleration | None:
        """Deceleration at a speed |q′|, whatever the direction: dry friction, quadratic drag.

        At speed zero it is what holds the mass; `None` if there is nothing of the kind.
        """

    @abc.abstractmethod
    def lever(self) -> Lever:
        """Metres that the point of contact moves per unit of the coordinate."""

    @abc.abstractmethod
    def is_angle(self) -> bool:
        """Whether the coordinate is an angle [rad]; otherwise it is a displacement [m]."""

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))
