"""A mass on a linear spring."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.parameter import as_optional_parameter, as_parameter, parameter
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

    omega_n: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0)
    )
    zeta: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("1", at_least=0), default=0.0
    )
    mass: Mass = eqx.field(
        converter=as_parameter,
        metadata=parameter("kg", above=0, known=True),
        default=1.0,
        kw_only=True,
    )
    dry_friction: CoordinateAcceleration | None = eqx.field(
        converter=as_optional_parameter,
        metadata=parameter("m/s²", at_least=0),
        default=None,
        kw_only=True,
    )

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        del t
        return -2 * self.zeta * self.omega_n * velocity - self.omega_n**2 * position

    def lever(self) -> Lever:
        return jnp.ones_like(self.mass)

    def is_angle(self) -> bool:
        return False
