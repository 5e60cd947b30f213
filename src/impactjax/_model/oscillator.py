"""What moves between the impacts."""

import abc
from typing import TypeVar

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

    Your own needs the field and the abstract methods. The other methods, on NumPy's arrays, are
    what a first look at a record asks, to see where a search starts; left as they are, it starts
    from the oscillator's own values.
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

    def natural_frequency(
        self, heights: Heights, gap: float, durations: Float[np.ndarray, " flights"]
    ) -> Float[np.ndarray, " flights"] | None:
        """Natural frequencies that flights from the stop and back show [rad/s]; `None` if the
        oscillator has none. Heights are distances from the stop, which is `gap` below the origin.
        """
        del heights, gap, durations

    def with_motion(self: Own, omega_n: float, zeta: float) -> Own:
        """The oscillator with a natural frequency and a damping ratio, if it has them."""
        del omega_n, zeta
        return self

    def half_period(self, height: float) -> float | None:
        """About the time between two turns [s] of a motion up to a height above the stop; `None`
        if the mass does not turn by itself.
        """
        del height

    def speed_at_stop(self, heights: Heights, gap: float) -> Heights:
        """Speed at the stop [m/s] of a fall from rest at a height above it; 0 if it is not reached.
        By default one that rises with the height.
        """
        del gap
        return np.maximum(heights, 0)

    def restoring(self, places: Places) -> Places:
        """The shape of the restoring acceleration, −a(q) / ω_n²."""
        return places

    def free_acceleration(self, places: Places) -> Places:
        """Acceleration in flight, friction left out."""
        return np.zeros_like(places)

    def has_equilibrium(self) -> bool:
        """Whether the mass swings about a place of its own, whatever stops there are."""
        return False

    def weight(self) -> float | None:
        """Constant acceleration towards the stop in flight [m/s²]; `None` if it is not constant."""

    def __check_init__(self) -> None:
        raise_if_violated(self, range_requirements(self))

    __repr__ = with_numbers
