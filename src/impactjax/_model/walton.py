"""A linear spring whose damping grows with penetration."""

import equinox as eqx
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents
from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.power import Coefficient, power_force
from impactjax._model.separable import restitution_damping, separable_equivalents
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter, require_restitution
from impactjax._types import Force, Length, Mass, Numbers, Speed


class Walton(AbstractMemorylessLaw):
    """Linear spring with a damping that grows with penetration: F = k δ + c δ δ′.

    The force vanishes with the penetration and not before. Restitution falls with speed and depends
    on λ |v⁻|, λ = c / k, alone: speeds alone do not determine k and c separately.

    Source: Walton (1992); Carter (2005), 3.23 to 3.30.

    **Arguments:**

    - `k`: stiffness [N/m].
    - `c`: damping [N s/m²].
    """

    k: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N/m", above=0, power=-0.5)
    )
    c: Coefficient = eqx.field(converter=as_parameter, metadata=parameter("N s/m²", at_least=0))
    separation: AbstractSeparation = eqx.field(init=False, default=AtZeroPenetration())

    @staticmethod
    def from_restitution(k: ArrayLike, r: ArrayLike, speed: ArrayLike) -> "Walton":
        """The law with a given coefficient of restitution at a speed [m/s].

        **Raises** `ValueError` for r above 1, or at most 0, which no finite damping gives.
        """
        require_restitution(r, zero=False)
        return Walton(k, as_parameter(k) * restitution_damping(r, speed))

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal, mass
        return power_force(penetration, rate, self.k, self.c, 1, 1, 1)

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents:
        """Outcome of an impact of a mass [kg] at a speed [m/s], in closed form."""
        return separable_equivalents(self.k, self.c / self.k, 1.0, speed, mass)
