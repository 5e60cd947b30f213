"""Oscillators: the equation of motion between impacts."""

import abc
from typing import TYPE_CHECKING, TypeVar, cast

import equinox as eqx
import numpy as np
from jaxtyping import Float

from impactjax._parameter import raise_if_violated, range_requirements
from impactjax._shown import with_numbers
from impactjax._types import (
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    Lever,
    Mass,
    Time,
)

Own = TypeVar("Own", bound="AbstractOscillator")
Heights = Float[np.ndarray, " flights"]
Places = Float[np.ndarray, " places"]


class AbstractOscillator(eqx.Module):
    """One coordinate q in free flight: q″ = acceleration(t, q, q′) − resistance(|q′|) sgn q′.

    An oscillator of your own needs the field `mass` and the abstract methods. The other methods, on
    NumPy arrays, help a first look at a record to find starting values; with their defaults a
    search starts from the oscillator's own values.
    """

    if TYPE_CHECKING:  # a checker takes a field here for the first argument of every subclass
        mass = cast(Mass, None)
    else:
        mass: eqx.AbstractVar[Mass]

    @abc.abstractmethod
    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        """Acceleration in free flight, without resistance."""

    @abc.abstractmethod
    def resistance(self, speed: CoordinateRate) -> CoordinateAcceleration | None:
        """Deceleration at a speed |q′|, the same in both directions: dry friction, quadratic drag.

        Its value at speed zero is the greatest acceleration against which the mass sticks. `None`
        if there is no such resistance.
        """

    def smooth_until(self, t: Time) -> Time | None:
        """The next time at which the acceleration is not smooth: a step ends there. `None` if it is
        smooth at all times; NaN where the motion is not defined after `t`.
        """
        del t

    @abc.abstractmethod
    def lever(self) -> Lever:
        """Displacement of the point of contact [m] per unit of the coordinate."""

    @abc.abstractmethod
    def is_angle(self) -> bool:
        """True if the coordinate is an angle [rad], false if it is a displacement [m]."""

    def natural_frequency(
        self, heights: Heights, gap: float, durations: Float[np.ndarray, " flights"]
    ) -> Float[np.ndarray, " flights"] | None:
        """Natural frequencies [rad/s] from heights and durations of flights from the stop and back;
        `None` if the oscillator has none. Heights are distances from the stop, which is `gap` below
        the origin.
        """
        del heights, gap, durations

    def with_motion(self: Own, omega_n: float, zeta: float) -> Own:
        """The oscillator with a natural frequency and a damping ratio, if it has them."""
        del omega_n, zeta
        return self

    def half_period(self, height: float) -> float | None:
        """Approximate time between two turns [s] of a motion up to a height above the stop; `None`
        if the mass does not turn without a stop.
        """
        del height

    def speed_at_stop(self, heights: Heights, gap: float) -> Heights:
        """Speed at the stop [m/s] after a fall from rest at a height above it; 0 if the stop is not
        reached. The default only increases with the height.
        """
        del gap
        return np.maximum(heights, 0)

    def restoring(self, places: Places) -> Places:
        """Restoring acceleration divided by the squared natural frequency: −a(q) / ω_n²."""
        return places

    def free_acceleration(self, places: Places) -> Places:
        """Acceleration in flight, without friction."""
        return np.zeros_like(places)

    def inertia(self, times: Places, places: Places) -> Float[np.ndarray, "phases places"]:
        """Accelerations by the motion of the base, at phases of which all others are combinations;
        none if the base is at rest.
        """
        del times
        return np.zeros((0, len(places)))

    def is_forced(self) -> bool:
        """True if the base moves."""
        return len(self.inertia(np.zeros(1), np.zeros(1))) > 0

    def has_equilibrium(self) -> bool:
        """True if the mass swings about an equilibrium that does not depend on the stops."""
        return False

    def weight(self) -> float | None:
        """Constant acceleration towards the stop in flight [m/s²]; `None` if it is not constant."""

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    __repr__ = with_numbers
