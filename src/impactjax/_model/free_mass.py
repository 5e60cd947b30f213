"""A mass without any force in flight, for which closed forms of an impact are exact."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import as_parameter, parameter
from impactjax._types import Coordinate, CoordinateAcceleration, CoordinateRate, Lever, Mass, Time


class FreeMass(AbstractOscillator):
    """A mass on which no force acts in flight: x″ = 0.

    **Arguments:**

    - `mass`: [kg].
    """

    mass: Mass = eqx.field(
        converter=as_parameter, metadata=parameter("kg", above=0, known=True), default=1.0
    )

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        del t, velocity
        return jnp.zeros_like(position)

    def resistance(self, speed: CoordinateRate) -> None:
        del speed

    def lever(self) -> Lever:
        return jnp.ones_like(self.mass)

    def is_angle(self) -> bool:
        return False
