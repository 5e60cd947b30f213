"""A linear spring and a linear dashpot in series."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents, approach, equivalents
from impactjax._model.law import AbstractForceLaw
from impactjax._model.linear_contact import arc_ratio, damping_ratio, decay, half_turn
from impactjax._model.separation import AbstractSeparation, AtZeroForce
from impactjax._parameter import as_parameter, parameter, plain, require_restitution
from impactjax._types import AngularFrequency, Force, Length, Mass, Numbers, Ratio, Speed


class Maxwell(AbstractForceLaw):
    """Linear spring and dashpot in series: F = m ω0² (δ − d), d′ = 2 γ ω0 (δ − d).

    The internal state d is the dashpot's stroke [m], zero when contact begins. Contact ends when
    the spring is slack, at a residual indentation d = 2 γ |v⁻| (1 + r)/ω0. A mass that turns back
    inside the indentation meets the stop again at d. After the mass has left the indentation the
    stop recovers, so that the next impact is at zero penetration.

    If no other force acts, r and duration are those of `KelvinVoigt` at zero penetration with the
    same ω0 and γ; for γ ≥ 1 the mass does not come back.

    Source: Carter (2005), 3.21.

    **Arguments:**

    - `omega0`: natural frequency of the spring, ω0² = k / m [rad/s].
    - `gamma`: damping ratio during contact, 2 γ ω0 = k / c [1].
    """

    omega0: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0, power=-1)
    )
    gamma: Ratio = eqx.field(converter=as_parameter, metadata=parameter("1", at_least=0))
    separation: AbstractSeparation = eqx.field(init=False, default=AtZeroForce())

    @staticmethod
    def from_restitution(omega0: ArrayLike, r: ArrayLike) -> "Maxwell":
        """The law with a given coefficient of restitution, at every speed; γ = 1 for 0.

        **Raises** `ValueError` for an r above 1 or below 0.
        """
        require_restitution(r, zero=True)
        return Maxwell(omega0, damping_ratio(plain(as_parameter(r))))

    def touch(self, speed: Speed, mass: Mass) -> Length:
        del mass
        return jnp.zeros_like(speed)

    def force(self, penetration: Length, rate: Speed, internal: Length, mass: Mass) -> Force:
        del rate
        return mass * self.omega0**2 * (penetration - internal)

    def internal_rate(
        self, penetration: Length, rate: Speed, internal: Length, mass: Mass
    ) -> Speed:
        del rate, mass
        return 2 * self.gamma * self.omega0 * (penetration - internal)

    def equivalents(self, speed: Numbers, mass: Numbers) -> Equivalents:
        """Outcome of an impact of a mass [kg] at a speed [m/s], in closed form."""
        v, m = approach(speed, mass)
        arc, turn = arc_ratio(self.gamma), half_turn(self.gamma)
        return equivalents(
            v,
            m,
            restitution=decay(self.gamma, turn),
            duration=turn / self.omega0,
            deepest=v / self.omega0 * (2 * self.gamma + decay(self.gamma, turn - arc)),
            peak=m * v * self.omega0 * decay(self.gamma, arc),
        )
