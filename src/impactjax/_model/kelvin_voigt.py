"""A linear spring and a linear dashpot in parallel."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents, approach, equivalents
from impactjax._model.law import AbstractMemorylessLaw
from impactjax._model.linear_contact import (
    arc_ratio,
    damping_ratio,
    damping_ratio_without_pull,
    decay,
    half_turn,
)
from impactjax._model.separation import AbstractSeparation, AtZeroForce, AtZeroPenetration
from impactjax._parameter import as_parameter, parameter, plain, require_restitution
from impactjax._types import AngularFrequency, Force, Length, Mass, Numbers, Ratio, Speed


class KelvinVoigt(AbstractMemorylessLaw):
    """Linear spring and dashpot in parallel: F = m (ω0² δ + 2 γ ω0 δ′).

    If no other force acts, restitution and duration T do not depend on the speed. With separation
    at zero penetration r = exp(−π γ/√(1 − γ²)) and T = π/(ω0 √(1 − γ²)); for γ ≥ 1 the mass does
    not come back. With separation at zero force r = exp(−2 γ A) and T = 2 A/ω0, where
    A = arccos γ/√(1 − γ²) for γ < 1 and arcosh γ/√(γ² − 1) beyond.

    Source: Carter (2005), 3.15 to 3.21; Schwager & Pöschel, Granular Matter 9, 465 (2007).

    **Arguments:**

    - `omega0`: natural frequency during contact, ω0² = k / m [rad/s].
    - `gamma`: damping ratio during contact, 2 γ ω0 = c / m [1].
    - `separation`: rule for the end of the contact.
    """

    omega0: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0, power=-1)
    )
    gamma: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", at_least=0))
    separation: AbstractSeparation = eqx.field(default=AtZeroPenetration(), kw_only=True)

    @staticmethod
    def from_restitution(
        omega0: ArrayLike, r: ArrayLike, *, separation: AbstractSeparation = AtZeroPenetration()
    ) -> "KelvinVoigt":
        """The law with a given coefficient of restitution, at every speed.

        **Raises** `ValueError` for r above 1 or below 0. r = 0 is γ = 1 with separation at zero
        penetration; with separation at zero force it raises too, since no finite damping gives it.
        """
        without_pull = isinstance(separation, AtZeroForce)
        require_restitution(r, zero=not without_pull)
        inverse = damping_ratio_without_pull if without_pull else damping_ratio
        return KelvinVoigt(omega0, inverse(plain(as_parameter(r))), separation=separation)

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal
        return mass * self.omega0 * (self.omega0 * penetration + 2 * self.gamma * rate)

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents:
        """Outcome of an impact of a mass [kg] at a speed [m/s], in closed form."""
        v, m = approach(speed, mass)
        return kelvin_voigt_equivalents(self.omega0, self.gamma, self.separation, v, m)


def kelvin_voigt_equivalents(
    omega0: AngularFrequency, gamma: Ratio, separation: AbstractSeparation, v: Speed, m: Mass
) -> Equivalents:
    """Equivalents of an impact at speed v of a mass m."""
    arc, turn = arc_ratio(gamma), half_turn(gamma)
    duration = 2 * arc if isinstance(separation, AtZeroForce) else turn
    force_rises = gamma < 1 / 2
    later = decay(gamma, jnp.where(force_rises, 3 * arc - turn, 0))
    return equivalents(
        v,
        m,
        restitution=decay(gamma, duration),
        duration=duration / omega0,
        deepest=v / omega0 * decay(gamma, arc),
        peak=m * v * omega0 * jnp.where(force_rises, later, 2 * gamma),
    )
