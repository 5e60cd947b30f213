"""The interface of a flight between a stop and a peak."""

import abc

import equinox as eqx

from impactjax._model.oscillator import AbstractOscillator
from impactjax._types import Coordinate, Ratio, Speed


class AbstractFlight(eqx.Module):
    """How the speed at the stop follows from the peak of a flight."""

    @abc.abstractmethod
    def speed(self, oscillator: AbstractOscillator, peak: Coordinate, direction: Ratio) -> Speed:
        """Speed at the stop of the fall from a peak, or of the rise to it [m/s].

        **Arguments:**

        - `oscillator`: what flies.
        - `peak`: where it is at rest [rad] or [m].
        - `direction`: 1 for the fall; −1 for the rise, a fall with time running backwards.
        """
