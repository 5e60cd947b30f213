"""The free pendulum by the method of multiple scales."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._model.initial_state import InitialState
from impactjax._model.lambert import phi1
from impactjax._model.pendulum import Pendulum
from impactjax._model.root import root
from impactjax._parameter import as_parameter
from impactjax._types import Coordinate, CoordinateRate, Numbers, Ratio, Time


class MultipleScales(eqx.Module):
    """Free decay of a damped pendulum by multiple scales to second order, from any initial state.

    With the amplitude a = a0 exp(−ζ ω_n t),

    θ = a cos(ω_n t + a² / (32 ζ) + φ0), θ′ = −ω_n a sin(ω_n t + a² / (32 ζ) + φ0),

    which is the linear oscillator with another phase angle χ:

    θ = exp(−ζ ω_n t) (θ0 cos χ + (θ0′ / ω_n) sin χ),
    χ = ω_n t − (a0² − a²) / (32 ζ), a0² = θ0² + (θ0′ / ω_n)².

    This form needs no root-finding for a0 and φ0, and is valid at ζ = 0 too. Cases I (released at
    rest) and II (launched from θ = 0) are `InitialState(theta0)` and `InitialState(0.0, speed)`.

    The velocity is the first-order one of the source: it neglects the decay of the amplitude and
    the decrease of the frequency with amplitude. It is not the derivative of the position.

    Valid for ζ ≪ 1 and small amplitudes. The phase drifts by about ω_n a0⁴ / 3072 [rad/s]; the
    velocity at the lowest point is too large by a0² / 24: 2.7 % at 45 degrees.

    Source: Carter (2005), 2.27 to 2.33.

    **Arguments:**

    - `pendulum`: without dry friction, on a base at rest.
    - `initial`: the state at time zero [rad], [rad/s].

    **Raises** `ValueError` for a pendulum with dry friction or a moving base.
    """

    pendulum: Pendulum
    initial: InitialState

    def __check_init__(self) -> None:
        if self.pendulum.dry_friction is not None or self.pendulum.base is not None:
            raise ValueError(
                "Argument `pendulum` must have neither dry friction nor a moving base: the "
                "multiple-scales solution knows viscous damping alone."
            )

    def position(self, ts: Numbers) -> Coordinate:
        """Angle at some times [rad]."""
        ts, cosine_part, sine_part = as_parameter(ts), *self._parts()
        turned = self._turned(ts)
        return self._decay(ts) * (cosine_part * jnp.cos(turned) + sine_part * jnp.sin(turned))

    def velocity(self, ts: Numbers) -> CoordinateRate:
        """Angular velocity at some times, of first order [rad/s]."""
        ts, cosine_part, sine_part = as_parameter(ts), *self._parts()
        turned = self._turned(ts)
        quadrature = sine_part * jnp.cos(turned) - cosine_part * jnp.sin(turned)
        return self.pendulum.omega_n * self._decay(ts) * quadrature

    def time_to_turn(self, angle: Numbers) -> Time:
        """Time [s] at which the phase has advanced by an angle [rad]; negative for a negative one.

        A quarter turn, π/2, leads from rest to θ = 0, and half a turn from θ = 0 to θ = 0.
        """
        omega_n, softening = self.pendulum.omega_n, self._softening()
        angle = as_parameter(angle) + jnp.zeros_like(softening)
        turn = root(_missing, angle / (1 - softening), (self.pendulum.zeta, softening, angle))
        return turn / omega_n

    def _parts(self) -> tuple[Coordinate, Coordinate]:
        return self.initial.position, self.initial.velocity / self.pendulum.omega_n

    def _decay(self, ts: Time) -> Ratio:
        return jnp.exp(-self.pendulum.zeta * self.pendulum.omega_n * ts)

    def _turned(self, ts: Time) -> Float[Array, "..."]:
        return _turned(self.pendulum.omega_n * ts, self.pendulum.zeta, self._softening())

    def _softening(self) -> Ratio:
        """Relative decrease a0²/16 of the initial frequency by the amplitude."""
        cosine_part, sine_part = self._parts()
        return (cosine_part**2 + sine_part**2) / 16


def _turned(linear: Float[Array, "..."], zeta: Ratio, softening: Ratio) -> Float[Array, "..."]:
    """Phase angle when that of a pendulum of vanishing amplitude is `linear`."""
    return linear * (1 - softening * phi1(-2 * zeta * linear))


def _missing(
    linear: Float[Array, "..."], parameters: tuple[Ratio, Ratio, Float[Array, "..."]]
) -> Float[Array, "..."]:
    zeta, softening, angle = parameters
    return _turned(linear, zeta, softening) - angle
