"""A ball that falls onto a floor."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.parameter import as_parameter, parameter
from impactjax._model.pendulum import STANDARD_GRAVITY
from impactjax._types import Coordinate, CoordinateAcceleration, CoordinateRate, Lever, Mass, Time


class BouncingBall(AbstractOscillator):
    """A ball in uniform gravity, x upwards from the floor: x″ = −gravity.

    **Arguments:**

    - `gravity`: [m/s²].
    - `mass`: [kg].
    """

    gravity: CoordinateAcceleration = eqx.field(
        converter=as_parameter,
        metadata=parameter("m/s²", at_least=0, known=True),
        default=STANDARD_GRAVITY,
    )
    mass: Mass = eqx.field(
        converter=as_parameter,
        metadata=parameter("kg", above=0, known=True),
        default=1.0,
        kw_only=True,
    )
    dry_friction: CoordinateAcceleration | None = eqx.field(init=False, default=None)

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        del t, position, velocity
        return -self.gravity

    def lever(self) -> Lever:
        return jnp.ones_like(self.mass)

    def is_angle(self) -> bool:
        return False
