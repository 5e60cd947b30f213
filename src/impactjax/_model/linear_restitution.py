"""Restitution that falls linearly with the speed of impact."""

import equinox as eqx

from impactjax._model.law import AbstractImpactLaw
from impactjax._model.parameter import Requirement, as_parameter, finite, within
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

    r0: Ratio = eqx.field(converter=as_parameter)
    alpha: InverseSpeed = eqx.field(converter=as_parameter)

    def restitution(self, speed: Speed) -> Ratio:
        return self.r0 - self.alpha * speed

    def requirements(self) -> tuple[Requirement, ...]:
        return within("r0", self.r0, 0, 1), finite("alpha", self.alpha)
