"""A spring with any exponent and a damping in proportion to its force."""

import equinox as eqx
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents
from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.power import HERTZIAN, Coefficient, power_force
from impactjax._model.separable import restitution_damping, separable_equivalents
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter, require_restitution
from impactjax._types import Force, InverseSpeed, Length, Mass, Numbers, Ratio, Speed


class HuntCrossley(AbstractMemorylessLaw):
    """A spring with any exponent and a damping in proportion to its force: F = k δⁿ (1 + c δ′).

    Hunt and Crossley write F = k δⁿ + λ δⁿ δ′; here c = λ/k, whose unit does not depend on n and
    which alone shows in the restitution: r ≈ 1 − (2/3) c |v⁻| at low speed (theirs: λ = (3/2) α k
    for r = 1 − α |v⁻|). The force vanishes with the penetration and not before.

    Source: Hunt & Crossley, Journal of Applied Mechanics 42, 440 (1975).

    **Arguments:**

    - `k`: stiffness [N/mⁿ].
    - `c`: damping per stiffness [s/m].
    - `n`: exponent [1]; 3/2 for a sphere on a plane (`Simon`), 1 for a flat punch (`Walton`).
    """

    k: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N/m^n", above=0, power=HERTZIAN)
    )
    c: InverseSpeed = eqx.field(converter=as_parameter, metadata=parameter("s/m", at_least=0))
    n: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("1", above=0, known=True), default=1.5
    )
    separation: AbstractSeparation = eqx.field(init=False, default=AtZeroPenetration())

    @staticmethod
    def from_restitution(
        k: ArrayLike, r: ArrayLike, speed: ArrayLike, n: ArrayLike = 1.5
    ) -> "HuntCrossley":
        """The law with a given coefficient of restitution at a speed [m/s].

        **Raises** `ValueError` for r above 1, or at most 0, which no finite damping gives.
        """
        require_restitution(r, zero=False)
        return HuntCrossley(k, restitution_damping(r, speed), n)

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal, mass
        return power_force(penetration, rate, self.k, self.k * self.c, self.n, self.n, 1)

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents:
        """Outcome of an impact of a mass [kg] at a speed [m/s], in closed form."""
        return separable_equivalents(self.k, self.c, self.n, speed, mass)
