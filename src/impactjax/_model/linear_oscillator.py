"""A mass on a linear spring."""

import equinox as eqx

from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.parameter import (
    Requirement,
    as_optional_parameter,
    as_parameter,
    not_negative,
    positive,
)
from impactjax._types import (
    AngularFrequency,
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    Lever,
    Mass,
    Ratio,
    Time,
)


class LinearOscillator(AbstractOscillator):
    """A mass on a linear spring: x″ + 2 ζ ω_n x′ + ω_n² x + dry_friction sgn x′ = 0.

    **Arguments:**

    - `omega_n`: natural frequency [rad/s].
    - `zeta`: damping ratio [1].
    - `mass`: [kg].
    - `dry_friction`: deceleration by Coulomb friction [m/s²]; left out of the physics if `None`.
    """

    omega_n: AngularFrequency = eqx.field(converter=as_parameter)
    zeta: Ratio = eqx.field(converter=as_parameter, default=0.0)
    mass: Mass = eqx.field(converter=as_parameter, default=1.0, kw_only=True)
    dry_friction: CoordinateAcceleration | None = eqx.field(
        converter=as_optional_parameter, default=None, kw_only=True
    )

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        del t
        return -2 * self.zeta * self.omega_n * velocity - self.omega_n**2 * position

    def lever(self) -> Lever:
        return as_parameter(1.0)

    def is_angle(self) -> bool:
        return False

    def requirements(self) -> tuple[Requirement, ...]:
        friction = () if self.dry_friction is None else (self.dry_friction,)
        return (
            positive("omega_n", self.omega_n),
            not_negative("zeta", self.zeta),
            positive("mass", self.mass),
            *(not_negative("dry_friction", value) for value in friction),
        )
