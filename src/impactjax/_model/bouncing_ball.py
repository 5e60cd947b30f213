"""A ball that falls onto a floor."""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from impactjax._model.base_motion import AbstractBaseMotion, as_base, inertias
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._model.oscillator import AbstractOscillator, Heights, Places
from impactjax._parameter import as_optional_parameter, as_parameter, parameter
from impactjax._types import (
    Coordinate,
    CoordinateAcceleration,
    CoordinateRate,
    InverseLength,
    Lever,
    Mass,
    Time,
)


class BouncingBall(AbstractOscillator):
    """A ball in uniform gravity, with x upwards from the floor, optional drag and optional shaking:

    x″ = −gravity − drag |x′| x′ + A Ω² sin(Ω t + φ).

    **Arguments:**

    - `gravity`: acceleration of free fall [m/s²].
    - `mass`: mass [kg].
    - `drag`: quadratic air drag: half the density of air times the ball's drag area, divided by its
      mass [1/m]; no drag if `None`.
    - `base`: upward motion of the floor; none if `None`.

    **Raises** `ValueError` for drag together with a moving floor, where the speed relative to the
    floor is not that relative to the air.
    """

    gravity: CoordinateAcceleration = eqx.field(
        converter=as_parameter,
        metadata=parameter("m/s²", at_least=0, known=True),
        default=STANDARD_GRAVITY,
    )
    mass: Mass = eqx.field(
        converter=as_parameter,
        metadata=parameter("kg", above=0, known=True),
        default=1.0,
        kw_only=True,
    )
    drag: InverseLength | None = eqx.field(
        converter=as_optional_parameter,
        metadata=parameter("1/m", at_least=0),
        default=None,
        kw_only=True,
    )
    base: AbstractBaseMotion | None = eqx.field(converter=as_base, default=None, kw_only=True)

    def acceleration(
        self, t: Time, position: Coordinate, velocity: CoordinateRate
    ) -> CoordinateAcceleration:
        del position, velocity
        return -self.gravity if self.base is None else self.base.inertia(t) - self.gravity

    def smooth_until(self, t: Time) -> Time | None:
        return None if self.base is None else self.base.smooth_until(t)

    def resistance(self, speed: CoordinateRate) -> CoordinateAcceleration | None:
        return None if self.drag is None else self.drag * speed**2

    def lever(self) -> Lever:
        return jnp.ones_like(self.mass)

    def is_angle(self) -> bool:
        return False

    def half_period(self, height: float) -> float | None:
        gravity = float(self.gravity)
        return 2 * math.sqrt(2 * height / gravity) if gravity > 0 and height > 0 else None

    def speed_at_stop(self, heights: Heights, gap: float) -> Heights:
        del gap
        return np.sqrt(2 * float(self.gravity) * np.maximum(heights, 0))

    def free_acceleration(self, places: Places) -> Places:
        return np.full_like(places, -float(self.gravity))

    def inertia(self, times: Places, places: Places) -> Float[np.ndarray, "phases places"]:
        del places
        return inertias(self.base, times)

    def weight(self) -> float:
        return float(self.gravity)

    def __check_init__(self) -> None:
        if self.drag is not None and self.base is not None:
            raise ValueError(
                "BouncingBall: Argument `drag` needs a floor at rest, but `base` is given."
            )
