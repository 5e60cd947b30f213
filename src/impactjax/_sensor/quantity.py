"""Observed quantities, and the units in which they may be recorded."""

import abc
import math
from typing import ClassVar

import equinox as eqx
import numpy as np

from impactjax._first_look.coordinate import (
    from_pulses,
    from_swing,
    from_velocity,
    is_peaked,
    pulses,
)
from impactjax._first_look.hand_release import fall
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._sensor.forces import (
    acceleration,
    contact_force,
    proper_acceleration,
    slopes,
)
from impactjax._shown import with_numbers
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Samples

Row = np.ndarray  # a number, or a flag, a sample

_ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "°": math.pi / 180}
_ANGULAR_VELOCITIES = {"rad/s": 1.0, "deg/s": math.pi / 180, "°/s": math.pi / 180}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
_VELOCITIES = {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3}
_SQUARES = {
    "rad/s²": 1.0,
    "rad/s^2": 1.0,
    "rad/s2": 1.0,
    "deg/s²": math.pi / 180,
    "deg/s^2": math.pi / 180,
}
_ACCELERATIONS = {
    "m/s²": 1.0,
    "m/s^2": 1.0,
    "m/s2": 1.0,
    "mm/s²": 1e-3,
    "g": STANDARD_GRAVITY,
}
_FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}


class AbstractQuantity(eqx.Module):
    """A quantity that a trajectory has at every instant."""

    name: ClassVar[str]
    """Name in a file's header."""
    units: ClassVar[dict[str, float]]
    """Factors from each unit to the SI unit, which comes first."""
    shown: ClassVar[str]
    """Unit in figures and tables."""
    of_angle: ClassVar[bool | None]
    """True for oscillators whose coordinate is an angle, false for others, `None` for both."""

    is_place: ClassVar[bool] = False
    """True if it is the coordinate itself."""
    is_carried: ClassVar[bool] = False
    """True if its sensor usually moves with a falling body."""
    is_felt: ClassVar[bool] = False
    """True if it is zero in free fall."""

    @property
    def unit(self) -> str:
        """The SI unit."""
        return next(iter(self.units))

    def check_suits(self, model: ImpactOscillator) -> None:
        """Raises `ValueError` if a model does not have this quantity."""
        if self.of_angle not in (None, model.oscillator.is_angle()):
            raise ValueError(
                f"A record of {self.name} does not suit a {type(model.oscillator).__name__}."
            )

    @abc.abstractmethod
    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        """The quantity at the samples of a trajectory."""

    @abc.abstractmethod
    def rate(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        """The time derivative of the quantity at the samples."""

    @abc.abstractmethod
    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        """The coordinate, reconstructed roughly from recorded values for a first look."""

    def contacts(self, values: Row) -> list[tuple[int, int]]:
        """Index pairs of the contacts that appear as pulses: first sample, and first one after."""
        del values
        return []

    def free_fall(self, ts: Row, values: Row, valid: Row) -> tuple[float, float] | None:
        """Begin and end [s] of a free fall and its landing, after the body was held."""
        del ts, values, valid

    __repr__ = with_numbers


class AbstractPlace(AbstractQuantity):
    """The coordinate itself."""

    is_place: ClassVar[bool] = True

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        del model
        return trajectory.position

    def rate(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        del model
        return trajectory.velocity

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        del ts, oscillator
        return values


class AbstractDifferenced(AbstractQuantity):
    """A quantity whose rate is computed from differences of its samples."""

    def rate(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        return slopes(trajectory.ts, self.value(model, trajectory))


class AbstractSpeed(AbstractDifferenced):
    """The rate of the coordinate."""

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        del model
        return trajectory.velocity

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        del oscillator
        return from_velocity(ts, values)


class AbstractAcceleration(AbstractDifferenced):
    """The second derivative of the coordinate."""

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        return acceleration(model, trajectory)

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        if is_peaked(values):
            return from_pulses(ts, values, oscillator.weight())
        return from_swing(ts, values)

    def contacts(self, values: Row) -> list[tuple[int, int]]:
        return pulses(values) if is_peaked(values) else []


class Angle(AbstractPlace):
    """The angle of a pendulum."""

    name: ClassVar[str] = "angle"
    units: ClassVar[dict[str, float]] = _ANGLES
    shown: ClassVar[str] = "deg"
    of_angle: ClassVar[bool | None] = True


class AngularVelocity(AbstractSpeed):
    """The angular velocity of a pendulum."""

    name: ClassVar[str] = "angular velocity"
    units: ClassVar[dict[str, float]] = _ANGULAR_VELOCITIES
    shown: ClassVar[str] = "rad/s"
    of_angle: ClassVar[bool | None] = True


class AngularAcceleration(AbstractAcceleration):
    """The angular acceleration of a pendulum."""

    name: ClassVar[str] = "angular acceleration"
    units: ClassVar[dict[str, float]] = _SQUARES
    shown: ClassVar[str] = "rad/s²"
    of_angle: ClassVar[bool | None] = True


class Displacement(AbstractPlace):
    """The displacement of a mass on a line."""

    name: ClassVar[str] = "displacement"
    units: ClassVar[dict[str, float]] = _LENGTHS
    shown: ClassVar[str] = "mm"
    of_angle: ClassVar[bool | None] = False


class Velocity(AbstractSpeed):
    """The velocity of a mass on a line."""

    name: ClassVar[str] = "velocity"
    units: ClassVar[dict[str, float]] = _VELOCITIES
    shown: ClassVar[str] = "m/s"
    of_angle: ClassVar[bool | None] = False


class Acceleration(AbstractAcceleration):
    """The acceleration of a mass on a line, as seen from outside."""

    name: ClassVar[str] = "acceleration"
    units: ClassVar[dict[str, float]] = _ACCELERATIONS
    shown: ClassVar[str] = "m/s²"
    of_angle: ClassVar[bool | None] = False


class ProperAcceleration(AbstractDifferenced):
    """The proper acceleration, as of an accelerometer: contact and drag force divided by the mass,
    zero in free fall.
    """

    name: ClassVar[str] = "proper acceleration"
    units: ClassVar[dict[str, float]] = _ACCELERATIONS
    shown: ClassVar[str] = "m/s²"
    of_angle: ClassVar[bool | None] = False
    is_felt: ClassVar[bool] = True
    is_carried: ClassVar[bool] = True

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        return proper_acceleration(model, trajectory)

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        return from_pulses(ts, values, oscillator.weight())

    def contacts(self, values: Row) -> list[tuple[int, int]]:
        return pulses(values)

    def free_fall(self, ts: Row, values: Row, valid: Row) -> tuple[float, float] | None:
        return fall(ts, values, valid)


class ContactForce(AbstractDifferenced):
    """The force of the stops on the mass, along its coordinate."""

    name: ClassVar[str] = "contact force"
    units: ClassVar[dict[str, float]] = _FORCES
    shown: ClassVar[str] = "N"
    of_angle: ClassVar[bool | None] = None
    is_carried: ClassVar[bool] = True

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        return contact_force(model, trajectory)

    def check_suits(self, model: ImpactOscillator) -> None:
        laws = [stop.law for stop in (model.lower, model.upper) if stop is not None]
        if all(law.is_rigid() for law in laws):
            raise ValueError("No stop of the model has a force law, so there is no contact force.")

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        inertia = float(oscillator.mass * oscillator.lever())
        return from_pulses(ts, values / inertia, oscillator.weight())

    def contacts(self, values: Row) -> list[tuple[int, int]]:
        return pulses(values)


QUANTITIES: dict[str, AbstractQuantity] = {
    quantity.name: quantity
    for quantity in (
        Angle(),
        AngularVelocity(),
        AngularAcceleration(),
        Displacement(),
        Velocity(),
        Acceleration(),
        ProperAcceleration(),
        ContactForce(),
    )
}
"""Quantities by the headers of files."""

TIME, IMPACT_TIME = "time", "impact time"  # headers of sample times and of a list of impact times


def units_of(header: str) -> dict[str, float]:
    """Units of the quantity in a header, with factors to SI; empty for an unknown header."""
    if header in (TIME, IMPACT_TIME):
        return TIME_UNITS
    return QUANTITIES[header].units if header in QUANTITIES else {}


def observables() -> list[str]:
    """The headers of all quantities that may be recorded."""
    return [IMPACT_TIME, *QUANTITIES]
