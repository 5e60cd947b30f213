"""What was measured."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._measure.quantity import AbstractQuantity
from impactjax._types import Samples

Valid = Bool[Array, " observations"]

_PADDING = 1e-3  # distance of samples that only fill up, relative to the others'


class Recording(eqx.Module):
    """A quantity sampled in time.

    **Arguments:**

    - `ts`: strictly increasing [s].
    - `values`: in the quantity's SI unit.
    - `quantity`: what was observed.
    - `valid`: which samples count; all if left out. The others (empty, clipped) keep their place in
      time, so that a sensor's low-pass stays right, but a fit leaves them out.
    """

    ts: Samples
    values: Samples
    quantity: AbstractQuantity
    valid: Valid

    def __init__(
        self,
        ts: Samples,
        values: Samples,
        quantity: AbstractQuantity,
        valid: Valid | None = None,
    ) -> None:
        self.ts = ts
        self.values = values
        self.quantity = quantity
        self.valid = jnp.ones(values.shape, bool) if valid is None else valid

    def between(self, begin: float, end: float) -> "Recording":
        """The samples from one time to another [s]."""
        kept = (self.ts >= begin) & (self.ts <= end)
        return Recording(self.ts[kept], self.values[kept], self.quantity, self.valid[kept])

    def first(self, share: float) -> "Recording":
        """The recording with only the samples of the first part of its time counted."""
        end = self.ts[0] + share * (self.ts[-1] - self.ts[0])
        return Recording(self.ts, self.values, self.quantity, self.valid & (self.ts <= end))

    def padded(self, count: int) -> "Recording":
        """The recording with samples after its end, which do not count, up to a number of them:
        recordings of one length share one compiled program.
        """
        more = count - self.ts.shape[0]
        if more <= 0:
            return self
        beyond = jnp.arange(1, more + 1, dtype=self.ts.dtype)
        later = self.ts[-1] + _PADDING * (self.ts[-1] - self.ts[-2]) * beyond
        return Recording(
            jnp.concatenate([self.ts, later]),
            jnp.pad(self.values, (0, more), mode="edge"),
            self.quantity,
            jnp.pad(self.valid, (0, more)),
        )

    @property
    def observations(self) -> Int[Array, "..."]:
        """How many samples count."""
        return jnp.sum(self.valid, axis=-1)


class ImpactTimes(eqx.Module):
    """The times of successive impacts, as heard or seen.

    **Arguments:**

    - `times`: strictly increasing [s].
    - `valid`: which of them count; all if left out. An impact that was missed has a row that does
      not, so that those after it keep their number.
    """

    times: Float[Array, " impacts"]
    valid: Valid

    def __init__(self, times: Float[Array, " impacts"], valid: Valid | None = None) -> None:
        self.times = times
        self.valid = jnp.ones(times.shape, bool) if valid is None else valid

    def first(self, share: float) -> "ImpactTimes":
        """The impacts with only those in the first part of the time counted."""
        end = self.times[0] + share * (self.times[-1] - self.times[0])
        return ImpactTimes(self.times, self.valid & (self.times <= end))

    @property
    def observations(self) -> Int[Array, "..."]:
        """How many impacts count."""
        return jnp.sum(self.valid, axis=-1)


AnyRecording = Recording | ImpactTimes
