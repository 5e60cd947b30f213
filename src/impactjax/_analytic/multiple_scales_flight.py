"""A pendulum's flight between stop and peak by the method of multiple scales."""

import math

from impactjax._analytic.flight import AbstractFlight
from impactjax._analytic.multiple_scales import MultipleScales
from impactjax._model.initial_state import InitialState
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.pendulum import Pendulum
from impactjax._types import Coordinate, Ratio, Speed


class MultipleScalesFlight(AbstractFlight):
    """Speeds of a pendulum by `MultipleScales`; the stop stands at θ = 0.

    Case I gives the speed a quarter turn after a peak, case II the launch a quarter turn before it.
    Restitution between peaks p1 and p2 [rad] comes out too small by about (p1² − p2²) / 24 of
    itself: 0.24 % for 0.3 and 0.18.

    Source: Carter (2005), 3.11 to 3.14 and Figure 3.1.
    """

    def speed(self, oscillator: AbstractOscillator, peak: Coordinate, direction: Ratio) -> Speed:
        if not isinstance(oscillator, Pendulum):
            raise ValueError(
                "Argument `oscillator` must be a `Pendulum`, but it is a "
                f"`{type(oscillator).__name__}`: the multiple-scales solution knows no other."
            )
        flight = MultipleScales(oscillator, InitialState(peak))
        crossing = flight.time_to_turn(direction * (math.pi / 2))
        return -direction * oscillator.lever() * flight.velocity(crossing)
