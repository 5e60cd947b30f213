"""A ball that falls onto a floor."""

import equinox as eqx

from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.parameter import Requirement, as_parameter, finite, positive
from impactjax._model.pendulum import STANDARD_GRAVITY
from impactjax._types import Coordinate, CoordinateAcceleration, CoordinateRate, Lever, Mass, Time


class BouncingBall(AbstractOscillator):
    """A ball in uniform gravity, x upwards from the floor: x″ = −gravity.

    **Arguments:**

    - `gravity`: [m/s²].
    - `mass`: [kg].
    """

    gravity: CoordinateAcceleration = eqx.field(converter=as_parameter, default=STANDARD_GRAVITY)
    mass: Mass = eqx.field(converter=as_parameter, default=1.0)
    dry_friction: CoordinateAcceleration | None = eqx.field(init=False, default=None)

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        del t, position, velocity
        return -self.gravity

    def lever(self) -> Lever:
        return as_parameter(1.0)

    def is_angle(self) -> bool:
        return False

    def requirements(self) -> tuple[Requirement, ...]:
        return finite("gravity", self.gravity), positive("mass", self.mass)
