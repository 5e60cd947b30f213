"""Newton's restitution."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.law import AbstractImpactLaw
from impactjax._parameter import as_parameter, parameter
from impactjax._types import Ratio, Speed


class Restitution(AbstractImpactLaw):
    """The same coefficient of restitution at every speed: v⁺ = −r v⁻.

    Source: Carter (2005), 3.8 and 3.10.

    **Arguments:**

    - `r`: coefficient of restitution [1], from 0 (plastic) to 1 (elastic).
    """

    r: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", at_least=0, at_most=1))

    def restitution(self, speed: Speed) -> Ratio:
        return jnp.broadcast_to(self.r, jnp.shape(speed))
