"""Hertz's force times a power of the rate."""

import equinox as eqx

from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.power import HERTZIAN, Coefficient, power_force
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter
from impactjax._types import Force, Length, Mass, Ratio, Speed


class PustPeterka(AbstractMemorylessLaw):
    """Hertz's force times a power of the rate: F = k δ^{3/2} (1 + α |δ′|^q sgn δ′).

    The force vanishes with the penetration and not before. Restitution falls with speed; the thesis
    tried q = 1/2, 1, 3/2 and 2. For q < 1 the force has a kink at δ′ = 0, where a simulation takes
    small steps.

    Source: Půst & Peterka, Meccanica 38, 99 (2003); Carter (2005), 3.40.

    **Arguments:**

    - `k`: stiffness [N/m^{3/2}].
    - `alpha`: damping [s^q/m^q].
    - `q`: exponent of the rate [1].
    """

    k: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N/m^1.5", above=0, power=HERTZIAN)
    )
    alpha: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("s^q/m^q", at_least=0)
    )
    q: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("1", above=0, known=True), default=1.0
    )
    separation: AbstractSeparation = eqx.field(init=False, default=AtZeroPenetration())

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal, mass
        return power_force(penetration, rate, self.k, self.k * self.alpha, 1.5, 1.5, self.q)
