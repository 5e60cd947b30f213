"""A pendulum that may hit a stop."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy import special

from impactjax._model.base_motion import AbstractBaseMotion, as_base, inertias
from impactjax._model.equilibrium import AbstractEquilibrium, Hanging
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._model.oscillator import Heights, Places
from impactjax._model.swing import AbstractSwing
from impactjax._parameter import as_optional_parameter, as_parameter, parameter
from impactjax._types import (
    AngularFrequency,
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    Length,
    Lever,
    Mass,
    Ratio,
    Time,
)


class Pendulum(AbstractSwing):
    """A pendulum with viscous friction, optional dry friction and an optional motion of its base:

    θ″ + 2 ζ ω_n θ′ ± ω_n² sin θ + dry_friction sgn θ′ = (A / length) Ω² sin(Ω t + φ) cos θ,

    with + if the angle is counted from the hanging position and − if from the upright one.

    Source: Carter (2005), 2.10; dry friction is that of Coulomb.

    **Arguments:**

    - `omega_n`: natural frequency at small amplitude [rad/s].
    - `zeta`: damping ratio [1].
    - `length`: from the pivot to the point of contact [m]; it turns angular velocity into the
      speed at the stop. If `None`, that of a point mass on a light rod, g / ω_n².
    - `mass`: effective mass at the point of contact [kg].
    - `dry_friction`: deceleration by Coulomb friction [rad/s²]; no dry friction if `None`.
    - `base`: horizontal motion of the pivot and the stops; none if `None`.
    - `equilibrium`: position of zero angle, `Hanging()` or `Inverted()`; `omega_n` and `zeta` are
      those of the hanging pendulum in both cases.
    """

    omega_n: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0)
    )
    zeta: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("1", at_least=0), default=0.0
    )
    length: Length | None = eqx.field(
        converter=as_optional_parameter,
        metadata=parameter("m", above=0, known=True),
        default=None,
        kw_only=True,
    )
    mass: Mass = eqx.field(
        converter=as_parameter,
        metadata=parameter("kg", above=0, known=True),
        default=1.0,
        kw_only=True,
    )
    dry_friction: CoordinateAcceleration | None = eqx.field(
        converter=as_optional_parameter,
        metadata=parameter("rad/s²", at_least=0),
        default=None,
        kw_only=True,
    )
    base: AbstractBaseMotion | None = eqx.field(converter=as_base, default=None, kw_only=True)
    equilibrium: AbstractEquilibrium = eqx.field(default=Hanging(), kw_only=True)

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        pull = self.omega_n**2 * self.equilibrium.pull(position)
        free = -2 * self.zeta * self.omega_n * velocity - pull
        if self.base is None:
            return free
        return free + self.base.inertia(t) / self.lever() * jnp.cos(position)

    def smooth_until(self, t: Time) -> Time | None:
        return None if self.base is None else self.base.smooth_until(t)

    def resistance(self, speed: CoordinateRate) -> CoordinateAcceleration | None:
        del speed
        return self.dry_friction

    def lever(self) -> Lever:
        return STANDARD_GRAVITY / self.omega_n**2 if self.length is None else self.length

    def is_angle(self) -> bool:
        return True

    def phase(self, heights: Heights, gap: float) -> Heights:
        modulus = np.sin(np.clip(heights - gap, 1e-9, 3.1) / 2)
        share = np.clip(np.sin(gap / 2) / modulus, -1, 1)
        return 2 * (special.ellipk(modulus**2) + special.ellipkinc(np.arcsin(share), modulus**2))

    def squared_speed(self, heights: Heights, gap: float) -> Heights:
        return 4 * (np.sin(np.clip(heights - gap, 0, 3.1) / 2) ** 2 - np.sin(gap / 2) ** 2)

    def inertia(self, times: Places, places: Places) -> Float[np.ndarray, "phases places"]:
        return inertias(self.base, times) * np.cos(places) / float(self.lever())

    def restoring(self, places: Places) -> Places:
        return np.sin(places)
