"""A linear spring and a linear dashpot in parallel."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._model.law import AbstractForceLaw
from impactjax._model.parameter import as_parameter, parameter
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._types import AngularFrequency, Force, Length, Mass, Ratio, Speed


class KelvinVoigt(AbstractForceLaw):
    """Linear spring and dashpot in parallel: F = m (ω0² δ + 2 γ ω0 δ′).

    With separation at zero penetration and no other force, γ < 1: restitution
    r = exp(−π γ / √(1 − γ²)) at every speed, contact duration π / (ω0 √(1 − γ²)).
    With γ ≥ 1 the mass does not come back to zero penetration in finite time.

    Source: Carter (2005), 3.15 to 3.21.

    **Arguments:**

    - `omega0`: natural frequency during contact, ω0² = k / m [rad/s].
    - `gamma`: damping ratio during contact, 2 γ ω0 = c / m [1].
    - `separation`: when the contact ends.
    """

    omega0: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0)
    )
    gamma: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", at_least=0))
    separation: AbstractSeparation = eqx.field(default=AtZeroPenetration(), kw_only=True)

    @staticmethod
    def from_restitution(omega0: ArrayLike, r: ArrayLike) -> "KelvinVoigt":
        """The law with a given coefficient of restitution: γ = −ln r / √(π² + ln² r) (3.43)."""
        loss = jnp.log(jnp.asarray(r))
        return KelvinVoigt(omega0=omega0, gamma=-loss / jnp.sqrt(jnp.pi**2 + loss**2))

    def touch(self, speed: Speed, mass: Mass) -> tuple[()]:
        del speed, mass
        return ()

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal
        return mass * self.omega0 * (self.omega0 * penetration + 2 * self.gamma * rate)

    def internal_rate(
        self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass
    ) -> tuple[()]:
        del penetration, rate, mass
        return internal
