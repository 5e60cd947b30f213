"""A linear spring and a linear dashpot in parallel."""

import equinox as eqx

from impactjax._model.law import AbstractForceLaw
from impactjax._model.parameter import Requirement, as_parameter, not_negative, positive
from impactjax._model.separation import AbstractSeparation, AtZeroPenetration
from impactjax._types import AngularFrequency, Force, Length, Mass, Ratio, Speed


class KelvinVoigt(AbstractForceLaw):
    """Linear spring and dashpot in parallel: F = m (ω0² δ + 2 γ ω0 δ′).

    With separation at zero penetration and no other force, γ < 1: restitution
    r = exp(−π γ / √(1 − γ²)) at every speed, contact duration π / (ω0 √(1 − γ²)).
    With γ ≥ 1 the mass does not come back to zero penetration in finite time.

    Source: Carter (2005), 3.15 to 3.21.

    **Arguments:**

    - `omega0`: natural frequency during contact, ω0² = k / m [rad/s].
    - `gamma`: damping ratio during contact, 2 γ ω0 = c / m [1].
    - `separation`: when the contact ends.
    """

    omega0: AngularFrequency = eqx.field(converter=as_parameter)
    gamma: Ratio = eqx.field(converter=as_parameter)
    separation: AbstractSeparation = AtZeroPenetration()

    def touch(self, speed: Speed, mass: Mass) -> tuple[()]:
        del speed, mass
        return ()

    def force(self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass) -> Force:
        del internal
        return mass * self.omega0 * (self.omega0 * penetration + 2 * self.gamma * rate)

    def internal_rate(
        self, penetration: Length, rate: Speed, internal: tuple[()], mass: Mass
    ) -> tuple[()]:
        del penetration, rate, mass
        return internal

    def requirements(self) -> tuple[Requirement, ...]:
        return positive("omega0", self.omega0), not_negative("gamma", self.gamma)
