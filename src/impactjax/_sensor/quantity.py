"""Observed quantities, and the units in which they may be recorded."""

from typing import ClassVar

from jaxtyping import Array, Float

from impactjax._first_look.coordinate import (
    from_pulses,
    pulses,
)
from impactjax._first_look.hand_release import fall
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import plain
from impactjax._sensor.abstract_quantity import (
    AbstractAcceleration,
    AbstractPlace,
    AbstractPulsed,
    AbstractQuantity,
    AbstractSpeed,
    Row,
)
from impactjax._sensor.forces import (
    contact_force,
    inertia,
    proper_acceleration,
)
from impactjax._sensor.units import (
    ACCELERATIONS,
    ANGLES,
    ANGULAR_ACCELERATIONS,
    ANGULAR_VELOCITIES,
    FORCES,
    LENGTHS,
    TIME_UNITS,
    VELOCITIES,
)
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Samples


class Angle(AbstractPlace):
    """The angle of a pendulum."""

    name: ClassVar[str] = "angle"
    synonyms: ClassVar[tuple[str, ...]] = (
        *("theta", "θ", "phi", "φ", "rotation angle", "angular position", "winkel"),
    )
    units: ClassVar[dict[str, float]] = ANGLES
    shown: ClassVar[str] = "deg"
    of_angle: ClassVar[bool | None] = True


class AngularVelocity(AbstractSpeed):
    """The angular velocity of a pendulum."""

    name: ClassVar[str] = "angular velocity"
    synonyms: ClassVar[tuple[str, ...]] = (
        *("omega", "ω", "w", "gyroscope", "gyro", "gyr", "rotation rate", "angular rate"),
    )
    units: ClassVar[dict[str, float]] = ANGULAR_VELOCITIES
    shown: ClassVar[str] = "rad/s"
    of_angle: ClassVar[bool | None] = True
    of_places: ClassVar[AbstractQuantity | None] = Angle()


class AngularAcceleration(AbstractAcceleration):
    """The angular acceleration of a pendulum."""

    name: ClassVar[str] = "angular acceleration"
    synonyms: ClassVar[tuple[str, ...]] = ("alpha", "α")
    units: ClassVar[dict[str, float]] = ANGULAR_ACCELERATIONS
    shown: ClassVar[str] = "rad/s²"
    of_angle: ClassVar[bool | None] = True


class Displacement(AbstractPlace):
    """The displacement of a mass on a line."""

    name: ClassVar[str] = "displacement"
    synonyms: ClassVar[tuple[str, ...]] = (
        *(
            "position",
            "height",
            "h",
            "s",
            "distance",
            "elevation",
            "deflection",
            "elongation",
            "travel",
        ),
        *("weg", "ort", "höhe", "auslenkung", "hauteur", "posición", "posizione"),
    )
    units: ClassVar[dict[str, float]] = LENGTHS
    shown: ClassVar[str] = "mm"
    of_angle: ClassVar[bool | None] = False


class Velocity(AbstractSpeed):
    """The velocity of a mass on a line."""

    name: ClassVar[str] = "velocity"
    synonyms: ClassVar[tuple[str, ...]] = ("v", "linear velocity", "geschwindigkeit", "vitesse")
    units: ClassVar[dict[str, float]] = VELOCITIES
    shown: ClassVar[str] = "m/s"
    of_angle: ClassVar[bool | None] = False
    of_places: ClassVar[AbstractQuantity | None] = Displacement()


class Acceleration(AbstractAcceleration):
    """The acceleration of a mass on a line, as seen from outside."""

    name: ClassVar[str] = "acceleration"
    synonyms: ClassVar[tuple[str, ...]] = ("a", "acc", "linear acceleration", "user acceleration")
    units: ClassVar[dict[str, float]] = ACCELERATIONS
    shown: ClassVar[str] = "m/s²"
    of_angle: ClassVar[bool | None] = False
    shows_blows: ClassVar[bool] = True

    def push(self, values: Row, oscillator: AbstractOscillator) -> Row:
        del oscillator
        return values


class ProperAcceleration(AbstractPulsed):
    """The proper acceleration, as of an accelerometer: contact and drag force divided by the mass,
    zero in free fall.
    """

    name: ClassVar[str] = "proper acceleration"
    synonyms: ClassVar[tuple[str, ...]] = (
        *("accelerometer", "total acceleration", "acceleration with g", "g force"),
        *("accelerometer uncalibrated", "total accelerometer"),
    )
    units: ClassVar[dict[str, float]] = ACCELERATIONS
    shown: ClassVar[str] = "m/s²"
    of_angle: ClassVar[bool | None] = False
    is_felt: ClassVar[bool] = True
    is_carried: ClassVar[bool] = True

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        return proper_acceleration(model, trajectory)

    def factor(self, model: ImpactOscillator) -> Float[Array, "..."]:
        return model.oscillator.lever()

    def push(self, values: Row, oscillator: AbstractOscillator) -> Row:
        del oscillator
        return values

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        return from_pulses(ts, values, oscillator.weight())

    def contacts(self, values: Row) -> list[tuple[int, int]]:
        return pulses(values)

    def free_fall(self, ts: Row, values: Row, valid: Row) -> tuple[float, float] | None:
        return fall(ts, values, valid)


class ContactForce(AbstractPulsed):
    """The force of the stops on the mass, along its coordinate."""

    name: ClassVar[str] = "contact force"
    synonyms: ClassVar[tuple[str, ...]] = (
        *("force", "f", "fz", "impact force", "normal force", "load", "kraft"),
    )
    units: ClassVar[dict[str, float]] = FORCES
    shown: ClassVar[str] = "N"
    of_angle: ClassVar[bool | None] = None
    is_carried: ClassVar[bool] = True
    is_force: ClassVar[bool] = True
    shows_blows: ClassVar[bool] = True

    def value(self, model: ImpactOscillator, trajectory: Trajectory) -> Samples:
        return contact_force(model, trajectory)

    def factor(self, model: ImpactOscillator) -> Float[Array, "..."]:
        return inertia(model)

    def check_suits(self, model: ImpactOscillator) -> None:
        laws = [stop.law for stop in (model.lower, model.upper) if stop is not None]
        if all(law.is_rigid() for law in laws):
            raise ValueError("No stop of the model has a force law, so there is no contact force.")

    def push(self, values: Row, oscillator: AbstractOscillator) -> Row:
        return values / float(plain(oscillator.mass) * plain(oscillator.lever()))

    def coordinate(self, ts: Row, values: Row, oscillator: AbstractOscillator) -> Row:
        return from_pulses(ts, self.push(values, oscillator), oscillator.weight())

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
