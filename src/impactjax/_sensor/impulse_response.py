"""A low-pass filter given by its measured impulse response."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._parameter import Requirement, as_parameter, is_positive, raise_if_violated
from impactjax._sensor.forces import slopes
from impactjax._sensor.kinks import Kinks, kinks_of
from impactjax._sensor.low_pass import AbstractLowPass, Before
from impactjax._simulate.jumps import Jumps
from impactjax._types import Samples


class ImpulseResponse(AbstractLowPass):
    """A linear filter by its impulse response: y(t) = ∫ h(s) x(t − s) ds, by trapezoids.

    The input is a cubic with kinks between its samples; h is zero beyond its last sample.

    **Arguments:**

    - `response`: h at 0, `interval`, 2 `interval`, ... [1/s].
    - `interval`: between its samples [s].
    """

    response: Float[Array, " taps"] = eqx.field(converter=as_parameter)
    interval: Float[Array, ""] = eqx.field(converter=as_parameter)

    def __check_init__(self) -> None:
        if self.response.ndim != 1 or self.response.shape[0] < 2:
            raise ValueError(
                "Argument `response` must be a list of at least two numbers, but its shape is "
                f"{self.response.shape}."
            )
        finite = Requirement(jnp.isfinite(self.response), "Argument `response` must be finite")
        raise_if_violated(self, [finite, is_positive("interval", self.interval)])

    def filtered(
        self, ts: Samples, values: Samples, rates: Samples, jumps: Jumps | None = None
    ) -> Samples:
        weights = self.response * self.interval
        weights = weights.at[0].multiply(0.5).at[-1].multiply(0.5)
        return _between(self._seen(ts), ts, values, rates, kinks_of(jumps, ts)) @ weights

    def filtered_velocity(
        self, ts: Samples, positions: Samples, velocities: Samples, jumps: Jumps | None = None
    ) -> Samples:
        places = _between(self._seen(ts), ts, positions, velocities, kinks_of(jumps, ts))
        return -jnp.diff(places, axis=1) @ (self.response[1:] + self.response[:-1]) / 2

    def filtered_acceleration(
        self,
        ts: Samples,
        positions: Samples,
        velocities: Samples,
        before: Before,
        jumps: Jumps | None = None,
    ) -> Samples:
        at, kinks = self._seen(ts), kinks_of(jumps, ts)
        places = _between(at, ts, positions, velocities, kinks, before)
        slope, none = slopes(ts, velocities), kinks_of(None, ts)
        last = _between(at[:, -1:], ts, velocities, slope, none, before[1:])
        steps = jnp.diff(self.response) / self.interval
        ends = self.response[0] * velocities - self.response[-1] * last[:, 0]
        return ends - jnp.diff(places, axis=1) @ steps

    def _seen(self, ts: Samples) -> Float[Array, "samples taps"]:
        """The times whose input is in each sample."""
        lags = self.interval * jnp.arange(self.response.shape[0], dtype=ts.dtype)
        return ts[:, None] - lags


def _between(
    at: Float[Array, "samples taps"],
    ts: Samples,
    values: Samples,
    rates: Samples,
    kinks: Kinks,
    curvatures: tuple[Float[Array, ""], ...] = (),
) -> Float[Array, "samples taps"]:
    """Cubic Hermite interpolation of samples with their rates. The kinks in an interval stand at
    their mean time. Before the first sample a polynomial with given higher derivatives: a straight
    line without any.
    """
    i = jnp.clip(jnp.searchsorted(ts, at, side="right") - 1, 0, ts.shape[0] - 2)
    h = ts[i + 1] - ts[i]
    s = (at - ts[i]) / h
    ramp, step = kinks.summed(kinks.size * kinks.after, ts)[i], kinks.summed(kinks.size, ts)[i]
    rise = values[i + 1] - ramp - values[i]
    start, end = rates[i] * h, (rates[i + 1] - step) * h
    cubic = values[i] + s * (
        start + s * (3 * rise - 2 * start - end + s * (start + end - 2 * rise))
    )
    late = at - ts[i + 1] + ramp / jnp.where(step == 0, 1.0, step)
    kinked = cubic + step * jnp.maximum(late, 0.0)
    ahead = jnp.minimum(at - ts[0], 0.0)
    terms = [x * ahead**n / math.factorial(n) for n, x in enumerate(curvatures, start=2)]
    return jnp.where(at < ts[0], values[0] + rates[0] * ahead + sum(terms), kinked)
