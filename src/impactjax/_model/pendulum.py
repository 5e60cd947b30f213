"""A pendulum that may hit a stop."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

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
    Length,
    Lever,
    Mass,
    Ratio,
    Time,
)

STANDARD_GRAVITY = 9.80665


class Pendulum(AbstractOscillator):
    """A hanging pendulum with viscous and, if given, dry friction:

    θ″ + 2 ζ ω_n θ′ + ω_n² sin θ + dry_friction sgn θ′ = 0.

    Source: Carter (2005), 2.10 without base motion; dry friction is that of Coulomb.

    **Arguments:**

    - `omega_n`: natural frequency at small amplitude [rad/s].
    - `zeta`: damping ratio [1].
    - `length`: from the pivot to the point of contact [m]; it turns angular velocity into the
      speed at the stop. If left out, that of a point mass on a light rod, g / ω_n².
    - `mass`: effective mass at the point of contact [kg].
    - `dry_friction`: deceleration by Coulomb friction [rad/s²]; left out of the physics if `None`.
    """

    omega_n: AngularFrequency
    zeta: Ratio
    length: Length
    mass: Mass = eqx.field(converter=as_parameter)
    dry_friction: CoordinateAcceleration | None = eqx.field(converter=as_optional_parameter)

    def __init__(
        self,
        omega_n: ArrayLike,
        zeta: ArrayLike = 0.0,
        *,
        length: ArrayLike | None = None,
        mass: ArrayLike = 1.0,
        dry_friction: ArrayLike | None = None,
    ) -> None:
        self.omega_n = as_parameter(omega_n)
        self.zeta = as_parameter(zeta)
        self.length = as_parameter(STANDARD_GRAVITY / self.omega_n**2 if length is None else length)
        self.mass = as_parameter(mass)
        self.dry_friction = as_optional_parameter(dry_friction)

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        del t
        return -2 * self.zeta * self.omega_n * velocity - self.omega_n**2 * jnp.sin(position)

    def lever(self) -> Lever:
        return self.length

    def is_angle(self) -> bool:
        return True

    def requirements(self) -> tuple[Requirement, ...]:
        friction = () if self.dry_friction is None else (self.dry_friction,)
        return (
            positive("omega_n", self.omega_n),
            not_negative("zeta", self.zeta),
            positive("length", self.length),
            positive("mass", self.mass),
            *(not_negative("dry_friction", value) for value in friction),
        )
