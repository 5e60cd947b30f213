"""What moves between the impacts."""

import abc

import equinox as eqx

from impactjax._model.parameter import raise_if_violated, range_requirements
from impactjax._types import (
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    Lever,
    Mass,
    Time,
)


class AbstractOscillator(eqx.Module):
    """One coordinate q in free flight: q″ = acceleration(t, q, q′) − dry_friction sgn q′.

    Your own needs the two fields and the methods below: see `docs/your-own.md`.
    """

    mass: eqx.AbstractVar[Mass]
    dry_friction: eqx.AbstractVar[CoordinateAcceleration | None]

    @abc.abstractmethod
    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        """Acceleration in free flight, dry friction left out."""

    @abc.abstractmethod
    def lever(self) -> Lever:
        """Metres that the point of contact moves per unit of the coordinate."""

    @abc.abstractmethod
    def is_angle(self) -> bool:
        """Whether the coordinate is an angle [rad]; otherwise it is a displacement [m]."""

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))
