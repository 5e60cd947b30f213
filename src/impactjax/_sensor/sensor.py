"""The sensor: from a trajectory to its recording."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._known import AnyArray
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._parameter import (
    Requirement,
    as_optional_parameter,
    as_parameter,
    is_positive,
    parameter,
    plain,
    raise_if_violated,
    range_requirements,
)
from impactjax._refusal import of_kind
from impactjax._sensor.abstract_quantity import AbstractQuantity
from impactjax._sensor.low_pass import AbstractLowPass
from impactjax._shown import with_numbers
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Ratio, Samples, Time


class Sensor(eqx.Module):
    """A sensor: recorded(t) = gain · low_pass[quantity](t − delay) + offset + drift · t + noise.

    **Arguments:**

    - `gain`: dimensionless factor [1].
    - `offset`: constant added, in the quantity's SI unit.
    - `delay`: delay of the whole chain except the low-pass [s].
    - `drift`: linear trend of the zero, in the quantity's SI unit per second.
    - `low_pass`: anti-aliasing filter; none if `None`.
    - `sigma`: standard deviation of the noise, in the quantity's SI unit; estimated by the fit if
      `None`.
    - `quantisation`: step of the recorded values, in the quantity's SI unit; none if `None`.

    **Raises** `ValueError` for a value that is not finite, a gain of zero, and a `sigma` or
    `quantisation` that is not positive.
    """

    gain: Ratio = eqx.field(
        converter=as_parameter, metadata=parameter("1", known=True), default=1.0
    )
    offset: Float[Array, "..."] = eqx.field(
        converter=as_parameter, metadata=parameter("unit of the quantity", known=True), default=0.0
    )
    delay: Time = eqx.field(
        converter=as_parameter, metadata=parameter("s", known=True), default=0.0
    )
    drift: Float[Array, "..."] = eqx.field(
        converter=as_parameter,
        metadata=parameter("unit of the quantity per second", known=True),
        default=0.0,
    )
    low_pass: AbstractLowPass | None = eqx.field(
        converter=of_kind("low_pass", AbstractLowPass, "Butterworth(50.0)", optional=True),
        default=None,
    )
    sigma: Float[Array, "..."] | None = eqx.field(converter=as_optional_parameter, default=None)
    quantisation: Float[Array, "..."] | None = eqx.field(
        converter=as_optional_parameter, default=None
    )

    def __check_init__(self) -> None:
        requirements = [
            Requirement(plain(self.gain) != 0, "Argument `gain` must not be zero"),
            *range_requirements(self),
        ]
        for name, size in (("sigma", self.sigma), ("quantisation", self.quantisation)):
            if size is not None:
                requirements.append(is_positive(name, size))
        raise_if_violated(self, requirements)

    def shown(
        self, model: ImpactOscillator, trajectory: Trajectory, quantity: AbstractQuantity
    ) -> Samples:
        """The recorded values, from a trajectory sampled at the times `sampled`."""
        if self.low_pass is None:
            values = quantity.value(model, trajectory)
        else:
            values = quantity.filtered(self.low_pass, model, trajectory)
        every = self._density(quantity)
        return self._recorded(values[::every], trajectory.ts[::every])

    def shown_mean(self, trajectory: Trajectory) -> Float[Array, " intervals"]:
        """The means of a recorded velocity between successive samples, without a low-pass, from the
        coordinates at these samples.
        """
        ts = trajectory.ts
        means = jnp.diff(trajectory.position) / jnp.diff(ts)
        return self._recorded(means, (ts[1:] + ts[:-1]) / 2)

    def _recorded(self, values: Samples, ts: Samples) -> Samples:
        return self.gain * values + self.offset + self.drift * (ts + self.delay)

    def floor(self) -> Float[AnyArray, "..."]:
        """Variance of the quantisation error: step² / 12."""
        return np.zeros(()) if self.quantisation is None else self.quantisation**2 / 12

    def variance(self) -> Float[AnyArray, "..."] | None:
        """Variance of a recorded value, σ² plus that of quantisation; `None` if σ is not known."""
        return None if self.sigma is None else self.sigma**2 + self.floor()

    def sampled(self, ts: Samples, quantity: AbstractQuantity) -> Float[Array, " denser"]:
        """The times at which to sample the trajectory for a recording at `ts`. They are denser for
        a quantity that has pulses, if a low-pass sees what happens between the recorded samples.
        """
        density = self._density(quantity)
        steps = jnp.arange(density, dtype=ts.dtype) / density
        between = (ts[:-1, None] + jnp.diff(ts)[:, None] * steps).ravel()
        return jnp.append(between, ts[-1]) - self.delay

    def _density(self, quantity: AbstractQuantity) -> int:
        return 1 if self.low_pass is None else quantity.density

    __repr__ = with_numbers
