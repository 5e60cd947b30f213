"""The contact of the tasks: Kelvin-Voigt while gravity and flight damping do not act."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

import impactjax as ij

Number = Float[Array, "..."]


class ContactAlone(ij.AbstractForceLaw):
    """A Kelvin-Voigt stop that also takes up the pull ωn² sin θ and the drag 2 ζ ωn θ̇ of a pendulum
    of length 1 m.
    """

    omega0: Number = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("rad/s", above=0))
    gamma: Number = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1", at_least=0))
    pull: Number = eqx.field(
        converter=ij.as_parameter, metadata=ij.parameter("rad^2/s^2", known=True)
    )
    drag: Number = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1/s", known=True))
    separation: ij.AbstractSeparation = eqx.field(default=ij.AtZeroPenetration(), kw_only=True)

    def touch(self, speed: Number, mass: Number) -> tuple[()]:
        del speed, mass
        return ()

    def force(self, penetration: Number, rate: Number, internal: tuple[()], mass: Number) -> Number:
        del internal
        angle = -penetration  # of a lower stop; the same sine as the pendulum's own
        spring = self.omega0 * (self.omega0 * penetration + 2 * self.gamma * rate)
        free = self.drag * rate - self.pull * jnp.sin(angle)
        return mass * (spring - free)

    def internal_rate(
        self, penetration: Number, rate: Number, internal: tuple[()], mass: Number
    ) -> tuple[()]:
        del penetration, rate, mass
        return internal
