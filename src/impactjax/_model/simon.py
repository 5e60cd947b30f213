"""Hertz's force with a damping in proportion to it."""

import equinox as eqx
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents
from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.power import HERTZIAN, Coefficient, power_force
from impactjax._model.separable import restitution_damping, separable_equivalents
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter, require_restitution
from impactjax._types import Force, InverseSpeed, Length, Mass, Numbers, Speed


class Simon(AbstractMemorylessLaw):
    """Hertz's force with a damping in proportion to it: F = k δ^{3/2} (1 + c δ′).

    The force vanishes with the penetration and not before. Restitution falls with speed and depends
    on c |v⁻| alone, as Walton's does on λ |v⁻|.

    Source: Simon (1967); Carter (2005), 3.35 to 3.39.

    **Arguments:**

    - `k`: stiffness [N/m^{3/2}].
    - `c`: damping per stiffness [s/m].
    """

    k: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N/m^1.5", above=0, power=HERTZIAN)
    )
    c: InverseSpeed = eqx.field(converter=as_parameter, metadata=parameter("s/m", at_least=0))
    separation: AbstractSeparation = eqx.field(init=False, default=AtZeroPenetration())

    @staticmethod
    def from_restitution(k: ArrayLike, r: ArrayLike, speed: ArrayLike) -> "Simon":
        """The law with a given coefficient of restitution at a speed [m/s].

        **Raises** `ValueError` for r above 1, or at most 0, which no finite damping gives.
        """
        require_restitution(r, zero=False)
        return Simon(k, restitution_damping(r, speed))

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal, mass
        return power_force(penetration, rate, self.k, self.k * self.c, 1.5, 1.5, 1)

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents:
        """Outcome of an impact of a mass [kg] at a speed [m/s], in closed form."""
        return separable_equivalents(self.k, self.c, 1.5, speed, mass)
