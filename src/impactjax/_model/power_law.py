"""The general power law, of which the other nonlinear laws are members."""

import equinox as eqx

from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.power import HERTZIAN, Coefficient, power_force
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter
from impactjax._types import Force, Length, Mass, Ratio, Speed


class PowerLaw(AbstractMemorylessLaw):
    """Spring and dashpot with any exponents: F = k δⁿ + c δᵖ |δ′|^q sgn δ′.

    Its members by (n, p, q): linear spring and dashpot (1, 0, 1), `Walton` (1, 1, 1), `Simon`
    (3/2, 3/2, 1), `HuntCrossley` (n, n, 1), `PustPeterka` (3/2, 3/2, q), `HertzDashpot`
    (3/2, 0, 1); and (3/2, 1/4, 1), whose restitution is the same at every speed (Tsuji).

    For q < 1 the damping has a kink at δ′ = 0, where a simulation takes small steps. For 0 < p < 1
    its slope at δ = 0 is infinite; derivatives of a simulation are then good to four digits only.

    Source: Carter (2005), chapter 3, generalised; Tsuji, Tanaka & Ishida, Powder Technology 71,
    239 (1992).

    **Arguments:**

    - `k`: stiffness [N/mⁿ].
    - `c`: damping [N s^q/m^(p+q)].
    - `n`, `p`, `q`: exponents of the penetration in spring and damping, and of its rate [1].
    - `separation`: rule for the end of the contact.
    """

    k: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N/m^n", above=0, power=HERTZIAN)
    )
    c: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N s^q/m^(p+q)", at_least=0)
    )
    n: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", above=0, known=True))
    p: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", at_least=0, known=True))
    q: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", above=0, known=True))
    separation: AbstractSeparation = eqx.field(default=AtZeroPenetration(), kw_only=True)

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal, mass
        return power_force(penetration, rate, self.k, self.c, self.n, self.p, self.q)
