"""A motion of the base that has been measured."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._known import is_known
from impactjax._model.base_motion import AbstractBaseMotion
from impactjax._series.held import held
from impactjax._shown import with_numbers
from impactjax._types import Acceleration, Numbers, Time

_FEWEST = 5
_ROUNDING = 8.0  # units in the last place: a time so close before a knot belongs to what follows


class MeasuredMotion(AbstractBaseMotion):
    """Motion of the base and the stops whose acceleration has been measured.

    Between the samples it is a cubic spline with continuous second derivatives. A step ends at each
    sample, so that a run needs more of them than samples: raise `max_steps`.

    Derivatives by the measurement are zero, and its errors are no part of the intervals of a fit. A
    run that leaves its times ends with `RESULTS.non_finite`.

    **Arguments:**

    - `times`: times of the samples [s], at least 5.
    - `acceleration`: acceleration of the base [m/s²], positive in the direction of the coordinate.

    **Raises** `ValueError` for too few samples, times that do not increase, numbers that are not
    finite, and numbers that are not known while a program is traced.
    """

    times: Float[Array, " knots"]
    coefficients: Float[Array, "pieces powers"]

    def __init__(self, times: Numbers, acceleration: Numbers) -> None:
        from scipy.interpolate import CubicSpline  # a tenth of a second that others can do without

        knots, values = _checked(times, acceleration, "acceleration")
        self.times = jnp.asarray(knots, float)
        self.coefficients = jnp.asarray(CubicSpline(knots, values).c.T[:, ::-1], float)

    @classmethod
    def of_displacement(cls, times: Numbers, displacement: Numbers) -> "MeasuredMotion":
        """The motion with a measured displacement [m].

        Its acceleration is the second derivative of a smoothing spline, which is smoothed as much
        as generalised cross-validation asks for. That spline is straight at both ends, so measure a
        little longer than the run. An accelerometer tells the acceleration much better.

        Source: G. Wahba (1990), "Spline Models for Observational Data".
        """
        from scipy.interpolate import make_smoothing_spline

        knots, values = _checked(times, displacement, "displacement")
        return cls(knots, make_smoothing_spline(knots, values).derivative(2)(knots))

    def inertia(self, t: Time) -> Acceleration:
        piece = self._piece(held(t))
        s = t - jax.lax.stop_gradient(self.times)[piece].astype(t.dtype)
        own = jax.lax.stop_gradient(self.coefficients)  # they are not smooth from piece to piece
        powers = _unfused(own[piece].astype(t.dtype))
        value = powers[..., -1]
        for power in range(powers.shape[-1] - 2, -1, -1):
            value = value * s + powers[..., power]
        return -value

    def smooth_until(self, t: Time) -> Time:
        times = self.times.astype(t.dtype)
        after = times[self._piece(t) + 1]
        known = (t >= times[0]) & (_just_after(t) < times[-1])
        return jnp.where(known, after, jnp.nan)

    def _piece(self, t: Time) -> Array:
        """Number of the piece that holds from `t` on; the first or the last one outside."""
        times = self.times.astype(t.dtype)
        after = jnp.searchsorted(times, _just_after(t), side="right")
        return jnp.clip(after - 1, 0, len(times) - 2).astype(jnp.int32)

    __repr__ = with_numbers


def _just_after(t: Time) -> Time:
    return t + _ROUNDING * jnp.finfo(t.dtype).eps * jnp.abs(t)


def _unfused(powers: Array) -> Array:
    """The same numbers. XLA repeats what it fuses, here the reading of a row for each of thousands
    of uses, but not what a product of matrices returns.
    """
    unit = jnp.eye(powers.shape[-1], dtype=powers.dtype)
    return jnp.matmul(powers, unit, precision="highest")


def _checked(times: Numbers, values: Numbers, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a measurement, as NumPy arrays."""
    if not is_known((times, values)):
        raise ValueError("MeasuredMotion: The measurement must be known while a program is traced.")
    knots, measured = np.asarray(times, float), np.asarray(values, float)
    if knots.ndim != 1 or knots.shape != measured.shape:
        raise ValueError(
            f"MeasuredMotion: Arguments `times` and `{name}` must be lists of one length, but "
            f"their shapes are {knots.shape} and {measured.shape}."
        )
    if len(knots) < _FEWEST:
        raise ValueError(
            f"MeasuredMotion: There must be at least {_FEWEST} samples, but there are {len(knots)}."
        )
    if not (np.isfinite(knots).all() and np.isfinite(measured).all()):
        raise ValueError(f"MeasuredMotion: Arguments `times` and `{name}` must be finite.")
    if not (np.diff(knots) > 0).all():
        raise ValueError("MeasuredMotion: Argument `times` must increase strictly.")
    return knots, measured
