"""Kelvin-Voigt contact whose damping depends on the approach speed of each impact."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._model.equivalents import Equivalents, approach
from impactjax._model.kelvin_voigt import kelvin_voigt_equivalents
from impactjax._model.law import AbstractForceLaw
from impactjax._model.linear_contact import damping_ratio
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter
from impactjax._types import (
    AngularFrequency,
    Force,
    InverseSpeed,
    Length,
    Mass,
    Numbers,
    Ratio,
    Speed,
)


class KelvinVoigtLinearRestitution(AbstractForceLaw):
    """Kelvin-Voigt, F = m (ω0² δ + 2 γ ω0 δ′), with γ set at each impact so that r = r0 − α |v⁻|.

    γ = −ln r/√(π² + ln² r) is the internal state, constant during contact. Valid where 0 < r ≤ 1;
    an impact outside ends the run with `RESULTS.restitution_out_of_range`.

    Source: Carter (2005), 3.43 and 3.44.

    **Arguments:**

    - `omega0`: natural frequency during contact, ω0² = k / m [rad/s].
    - `r0`: coefficient of restitution at vanishing speed [1].
    - `alpha`: its decrease with speed [s/m].
    """

    omega0: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0, power=-1)
    )
    r0: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", above=0, at_most=1))
    alpha: InverseSpeed = eqx.field(converter=as_parameter, metadata=parameter("s/m"))
    separation: AbstractSeparation = eqx.field(init=False, default=AtZeroPenetration())

    def touch(self, speed: Speed, mass: Mass) -> Ratio:
        del mass
        r = self.r0 - self.alpha * speed
        valid = (r > 0) & (r <= 1)
        return jnp.where(valid, damping_ratio(jnp.where(valid, r, 1)), jnp.nan)

    def force(self, penetration: Length, rate: Speed, internal: Ratio, mass: Mass) -> Force:
        return mass * self.omega0 * (self.omega0 * penetration + 2 * internal * rate)

    def internal_rate(self, penetration: Length, rate: Speed, internal: Ratio, mass: Mass) -> Ratio:
        del penetration, rate, mass
        return jnp.zeros_like(internal)

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents:
        """Outcome of an impact of a mass [kg] at a speed [m/s], in closed form."""
        v, m = approach(speed, mass)
        return kelvin_voigt_equivalents(self.omega0, self.touch(v, m), self.separation, v, m)
