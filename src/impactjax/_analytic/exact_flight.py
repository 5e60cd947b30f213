"""The flight between stop and peak by simulation."""

import equinox as eqx
import jax
import jax.numpy as jnp

from impactjax._analytic.flight import AbstractFlight
from impactjax._model.base_motion import AbstractBaseMotion
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.restitution import Restitution
from impactjax._model.stop import Stop
from impactjax._parameter import as_parameter
from impactjax._simulate.simulate import simulate
from impactjax._types import (
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    Lever,
    Mass,
    Ratio,
    Scalar,
    Speed,
    Time,
)

_LONGEST = 25.0  # flight, in durations of a fall with the acceleration at the peak
_MAX_STEPS = 128


class ExactFlight(AbstractFlight):
    """Speeds of any oscillator, by simulation of its flight with all its losses. NaN if no flight
    connects stop and peak.

    **Arguments:**

    - `gap`: distance from the origin to the stop, which stands at −gap [rad] or [m].
    - `tolerance`: as in `simulate`.

    **Raises** `ValueError` for an oscillator on a moving base.
    """

    gap: Coordinate | float = 0.0
    tolerance: float | None = None

    def speed(self, oscillator: AbstractOscillator, peak: Coordinate, direction: Ratio) -> Speed:
        for part in ImpactOscillator(oscillator).parts().values():
            if isinstance(part, AbstractBaseMotion):
                raise ValueError("Argument `oscillator` must stand on a base at rest.")
        return _speed(oscillator, as_parameter(self.gap), peak, direction, self.tolerance)


class _TimeDirected(AbstractOscillator):
    """An oscillator with time running forwards (direction 1) or backwards (−1)."""

    oscillator: AbstractOscillator
    direction: Ratio
    mass: Mass

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        return self.oscillator.acceleration(t, position, self.direction * velocity)

    def resistance(self, speed: CoordinateRate) -> CoordinateAcceleration | None:
        resistance = self.oscillator.resistance(speed)
        return None if resistance is None else self.direction * resistance

    def lever(self) -> Lever:
        return self.oscillator.lever()

    def is_angle(self) -> bool:
        return self.oscillator.is_angle()


@eqx.filter_jit
def _speed(
    oscillator: AbstractOscillator,
    gap: Coordinate,
    peak: Coordinate,
    direction: Ratio,
    tolerance: float | None,
) -> Speed:
    def of_one(peak: Scalar, direction: Scalar) -> Scalar:
        flying = _TimeDirected(oscillator=oscillator, direction=direction, mass=oscillator.mass)
        plastic = Stop(Restitution(0.0), gap)  # nothing flies on after the first impact
        drive = oscillator.acceleration(jnp.zeros_like(peak), peak, jnp.zeros_like(peak))
        longest = _LONGEST * jnp.sqrt(2 * (peak + gap) / jnp.abs(drive))
        run = simulate(
            ImpactOscillator(flying, plastic),
            InitialState(peak),
            jax.lax.stop_gradient(jnp.stack([jnp.zeros_like(longest), longest])),
            tolerance=tolerance,
            max_steps=_MAX_STEPS,
            max_impacts=1,
        )
        return jnp.where(run.impacts.count > 0, run.impacts.approach_speed[0], jnp.nan)

    return jnp.vectorize(of_one)(peak, direction)
