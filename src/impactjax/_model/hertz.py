"""Two elastic bodies with round surfaces."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents
from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.power import HERTZIAN, Coefficient, power
from impactjax._model.separable import separable_equivalents
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter
from impactjax._types import Force, Length, Mass, Numbers, Speed


class Hertz(AbstractMemorylessLaw):
    """Two elastic bodies with round surfaces: F = k δ^{3/2}, r = 1.

    Valid for penetrations small against the radii, without friction or yielding, and for contacts
    much longer than waves need to cross the bodies.

    Source: Hertz, Journal für die reine und angewandte Mathematik 92, 156 (1882); Carter (2005),
    3.31 to 3.34.

    **Arguments:**

    - `k`: stiffness [N/m^{3/2}].
    """

    k: Coefficient = eqx.field(
        converter=as_parameter, metadata=parameter("N/m^1.5", above=0, power=HERTZIAN)
    )
    separation: AbstractSeparation = eqx.field(init=False, default=AtZeroPenetration())

    @staticmethod
    def from_material(
        E: ArrayLike,
        nu: ArrayLike,
        R: ArrayLike,
        *,
        E_other: ArrayLike = math.inf,
        nu_other: ArrayLike = 0.0,
        R_other: ArrayLike = math.inf,
    ) -> "Hertz":
        """The law of two spheres: k = (4/3) E* √R*, 1/E* = Σ (1 − ν²)/E, 1/R* = Σ 1/R.

        **Arguments:**

        - `E`, `nu`, `R`: modulus of elasticity [Pa], Poisson's ratio [1], radius [m].
        - `E_other`, `nu_other`, `R_other`: those of the other body; if left out, a rigid plane.
        """
        pairs = (E, nu), (E_other, nu_other)
        compliance = sum((1 - as_parameter(nu) ** 2) / as_parameter(E) for E, nu in pairs)
        curvature = 1 / as_parameter(R) + 1 / as_parameter(R_other)
        return Hertz(4 / (3 * compliance * jnp.sqrt(curvature)))

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del rate, internal, mass
        return self.k * power(penetration, 1.5)

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents:
        """Outcome of an impact of a mass [kg] at a speed [m/s], in closed form."""
        return separable_equivalents(self.k, jnp.zeros_like(self.k), 1.5, speed, mass)
