"""Restitution that falls as a power of the speed of impact."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.law import AbstractImpactLaw
from impactjax._parameter import as_parameter, parameter
from impactjax._types import Ratio, Speed


class PowerRestitution(AbstractImpactLaw):
    """Coefficient of restitution r = min(r0 |v⁻|^−α, 1), with v⁻ in m/s.

    Below the speed r0^{1/α} nothing yields and the impact is elastic, so r is never out of range;
    a motion that has become so slow bounces for ever. α = 1/4 is fully plastic contact.

    Source: Johnson, Contact Mechanics (1985), section 11.5.

    **Arguments:**

    - `r0`: coefficient of restitution at 1 m/s [(m/s)^α].
    - `alpha`: exponent of its decrease [1].
    """

    r0: Ratio = eqx.field(converter=as_parameter, metadata=parameter("(m/s)^alpha", at_least=0))
    alpha: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", at_least=0))

    def restitution(self, speed: Speed) -> Ratio:
        yields = speed**self.alpha > self.r0
        yielding = jnp.where(yields, speed, jnp.ones_like(speed))
        return jnp.where(yields, self.r0 * yielding**-self.alpha, jnp.ones_like(speed))
