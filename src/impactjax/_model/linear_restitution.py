"""Restitution that falls linearly with the speed of impact."""

import equinox as eqx

from impactjax._model.law import AbstractImpactLaw
from impactjax._parameter import as_parameter, parameter
from impactjax._types import InverseSpeed, Ratio, Speed


class LinearRestitution(AbstractImpactLaw):
    """Coefficient of restitution r = r0 − α |v⁻|.

    Valid where 0 ≤ r ≤ 1; an impact outside ends the run with
    `RESULTS.restitution_out_of_range`.

    Source: Carter (2005), 3.41.

    **Arguments:**

    - `r0`: coefficient of restitution at vanishing speed [1].
    - `alpha`: its decrease with speed [s/m].
    """

    r0: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", at_least=0, at_most=1))
    alpha: InverseSpeed = eqx.field(converter=as_parameter, metadata=parameter("s/m"))

    def restitution(self, speed: Speed) -> Ratio:
        return self.r0 - self.alpha * speed
