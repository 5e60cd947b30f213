"""A mass on a linear spring."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from impactjax._model.base_motion import AbstractBaseMotion, as_base, inertias
from impactjax._model.oscillator import Heights, Places
from impactjax._model.swing import AbstractSwing
from impactjax._parameter import as_optional_parameter, as_parameter, parameter
from impactjax._types import (
    AngularFrequency,
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    Lever,
    Mass,
    Ratio,
    Time,
)


class LinearOscillator(AbstractSwing):
    """A mass on a linear spring, with an optional motion of the base:

    x″ + 2 ζ ω_n x′ + ω_n² x + dry_friction sgn x′ = A Ω² sin(Ω t + φ).

    **Arguments:**

    - `omega_n`: natural frequency [rad/s].
    - `zeta`: damping ratio [1].
    - `mass`: [kg].
    - `dry_friction`: deceleration by Coulomb friction [m/s²]; no dry friction if `None`.
    - `base`: motion of the spring's foot and the stops; none if `None`.
    """

    omega_n: AngularFrequency = eqx.field(
        converter=as_parameter, metadata=parameter("rad/s", above=0)
    )
    zeta: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("1", at_least=0), default=0.0
    )
    mass: Mass = eqx.field(
        converter=as_parameter,
        metadata=parameter("kg", above=0, known=True),
        default=1.0,
        kw_only=True,
    )
    dry_friction: CoordinateAcceleration | None = eqx.field(
        converter=as_optional_parameter,
        metadata=parameter("m/s²", at_least=0),
        default=None,
        kw_only=True,
    )
    base: AbstractBaseMotion | None = eqx.field(converter=as_base, default=None, kw_only=True)

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        free = -2 * self.zeta * self.omega_n * velocity - self.omega_n**2 * position
        return free if self.base is None else free + self.base.inertia(t)

    def smooth_until(self, t: Time) -> Time | None:
        return None if self.base is None else self.base.smooth_until(t)

    def resistance(self, speed: CoordinateRate) -> CoordinateAcceleration | None:
        del speed
        return self.dry_friction

    def lever(self) -> Lever:
        return jnp.ones_like(self.mass)

    def is_angle(self) -> bool:
        return False

    def inertia(self, times: Places, places: Places) -> Float[np.ndarray, "phases places"]:
        del places
        return inertias(self.base, times)

    def phase(self, heights: Heights, gap: float) -> Heights:
        sizes = np.maximum(heights - gap, 1e-300)
        return np.pi + 2 * np.arcsin(np.clip(gap / sizes, -1, 1))

    def squared_speed(self, heights: Heights, gap: float) -> Heights:
        sizes = heights - gap
        return np.where(sizes > 0, sizes**2 - gap**2, 0.0)
