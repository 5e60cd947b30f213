"""Oscillators that swing about an equilibrium."""

import abc
from typing import TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Float

from impactjax._model.oscillator import AbstractOscillator, Heights, Places
from impactjax._parameter import as_parameter
from impactjax._types import AngularFrequency, Ratio

Own = TypeVar("Own", bound="AbstractSwing")


class AbstractSwing(AbstractOscillator):
    """An oscillator with a natural frequency and a damping ratio about an equilibrium."""

    omega_n: eqx.AbstractVar[AngularFrequency]
    zeta: eqx.AbstractVar[Ratio]

    @abc.abstractmethod
    def phase(self, heights: Heights, gap: float) -> Heights:
        """Duration of an undamped flight from the stop to a height and back, times ω_n; that of a
        whole swing if the stop is not reached.
        """

    @abc.abstractmethod
    def squared_speed(self, heights: Heights, gap: float) -> Heights:
        """Squared speed (q′ / ω_n)² at the stop after an undamped fall from rest at a height; at
        most 0 if the stop is not reached.
        """

    def natural_frequency(
        self, heights: Heights, gap: float, durations: Float[np.ndarray, " flights"]
    ) -> Float[np.ndarray, " flights"]:
        return self.phase(heights, gap) / durations

    def with_motion(self: Own, omega_n: float, zeta: float) -> Own:
        values = as_parameter(omega_n), as_parameter(zeta)
        return eqx.tree_at(lambda each: (each.omega_n, each.zeta), self, values)

    def half_period(self, height: float) -> float:
        del height
        return np.pi / float(self.omega_n)

    def speed_at_stop(self, heights: Heights, gap: float) -> Heights:
        squares = np.maximum(self.squared_speed(np.maximum(heights, 0), gap), 0)
        return float(self.lever()) * float(self.omega_n) * np.sqrt(squares)

    def free_acceleration(self, places: Places) -> Places:
        return -(float(self.omega_n) ** 2) * self.restoring(places)

    def has_equilibrium(self) -> bool:
        return True
