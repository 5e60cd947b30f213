"""The interface of a flight between a stop and a peak."""

import abc

import equinox as eqx

from impactjax._model.oscillator import AbstractOscillator
from impactjax._types import Coordinate, Ratio, Speed


class AbstractFlight(eqx.Module):
    """Relation between the peak of a flight and the speed at the stop."""

    @abc.abstractmethod
    def speed(self, oscillator: AbstractOscillator, peak: Coordinate, direction: Ratio) -> Speed:
        """Speed at the stop of the fall from a peak, or of the rise to it [m/s].

        **Arguments:**

        - `oscillator`: equation of motion.
        - `peak`: coordinate at which it is at rest [rad] or [m].
        - `direction`: 1 for the fall; −1 for the rise, a fall with time running backwards.
        """
