"""What an instrument observes, and the units it may be recorded in."""

import abc
import math
from typing import ClassVar

import equinox as eqx

from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Samples

_ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "°": math.pi / 180}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}


class AbstractQuantity(eqx.Module):
    """Something that can be read off a trajectory at every instant."""

    name: ClassVar[str]
    """As in a file's header."""
    units: ClassVar[dict[str, float]]
    """Factors to the SI unit, which comes first."""
    of_angle: ClassVar[bool]
    """Whether it belongs to an oscillator whose coordinate is an angle."""

    @property
    def unit(self) -> str:
        """The SI unit."""
        return next(iter(self.units))

    @abc.abstractmethod
    def value(self, trajectory: Trajectory) -> Samples:
        """The quantity at the samples of a trajectory."""

    @abc.abstractmethod
    def rate(self, trajectory: Trajectory) -> Samples:
        """Its time derivative there."""


class Angle(AbstractQuantity):
    """The angle of a pendulum."""

    name: ClassVar[str] = "angle"
    units: ClassVar[dict[str, float]] = _ANGLES
    of_angle: ClassVar[bool] = True

    def value(self, trajectory: Trajectory) -> Samples:
        return trajectory.position

    def rate(self, trajectory: Trajectory) -> Samples:
        return trajectory.velocity


class Displacement(AbstractQuantity):
    """The displacement of a mass on a line."""

    name: ClassVar[str] = "displacement"
    units: ClassVar[dict[str, float]] = _LENGTHS
    of_angle: ClassVar[bool] = False

    def value(self, trajectory: Trajectory) -> Samples:
        return trajectory.position

    def rate(self, trajectory: Trajectory) -> Samples:
        return trajectory.velocity


QUANTITIES: tuple[AbstractQuantity, ...] = (Angle(), Displacement())
TIME, IMPACT_TIME = "time", "impact time"  # the headers of a clock and of a list of bounce times
UNITS: dict[str, dict[str, float]] = {
    TIME: TIME_UNITS,
    IMPACT_TIME: TIME_UNITS,
    **{quantity.name: quantity.units for quantity in QUANTITIES},
}
