"""Hertz's spring and a linear dashpot."""

import equinox as eqx

from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.power import HERTZIAN, Coefficient, power_force
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter
from impactjax._types import Force, Length, Mass, Speed


class HertzDashpot(AbstractMemorylessLaw):
    """Hertz's spring and a linear dashpot in parallel: F = k δ^{3/2} + c δ′.

    Restitution rises with speed. The spring is so soft at small penetration that below some speed,
    which scales as c⁵/(k² m³), the mass does not come back to zero penetration.

    Source: Carter (2005), Figure 3.7. `k` from a material: `Hertz.from_material(...).k`.

    **Arguments:**

    - `k`: stiffness [N/m^{3/2}].
    - `c`: damping [N s/m].
    - `separation`: rule for the end of the contact.
    """

    k: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N/m^1.5", above=0, power=HERTZIAN)
    )
    c: Coefficient = eqx.field(converter=as_parameter, metadata=parameter("N s/m", at_least=0))
    separation: AbstractSeparation = eqx.field(default=AtZeroPenetration(), kw_only=True)

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal, mass
        return power_force(penetration, rate, self.k, self.c, 1.5, 0, 1)
