"""What was measured."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from impactjax._known import AnyArray, namespace
from impactjax._parameter import as_parameter, plain
from impactjax._sensor.quantity import AbstractQuantity
from impactjax._types import Samples

Valid = Bool[AnyArray, " observations"]

_PADDING = 1e-3  # distance of samples that only fill up, relative to the others'


class Recording(eqx.Module):
    """A quantity sampled in time.

    **Arguments:**

    - `ts`: strictly increasing [s].
    - `values`: in the quantity's SI unit.
    - `quantity`: what was observed.
    - `valid`: which samples count; all if left out. The others (empty, clipped) keep their place in
      time, so that a sensor's low-pass stays right, but a fit leaves them out. What is not finite
      does not count.

    **Raises** `ValueError` for lists that are empty or not of one length, and for times that do not
    increase.
    """

    ts: Samples
    values: Samples
    quantity: AbstractQuantity
    valid: Valid

    def __init__(
        self,
        ts: ArrayLike,
        values: ArrayLike,
        quantity: AbstractQuantity,
        valid: ArrayLike | None = None,
    ) -> None:
        self.ts = as_parameter(ts)
        self.values = as_parameter(values)
        self.quantity = quantity
        _check_list("ts", self.ts, self.ts.shape)
        _check_list("values", self.values, self.ts.shape)
        _check_increasing("ts", self.ts)
        self.valid = _counted(self.values, valid)

    def between(self, begin: float, end: float) -> "Recording":
        """The samples from one time to another [s]."""
        kept = (self.ts >= begin) & (self.ts <= end)
        return Recording(self.ts[kept], self.values[kept], self.quantity, self.valid[kept])

    def first(self, share: float) -> "Recording":
        """The recording with only the samples of the first part of its time counted."""
        return Recording(self.ts, self.values, self.quantity, self.within(share))

    def within(self, share: float) -> Valid:
        """Which samples count in the first part of the time."""
        ts = plain(self.ts)
        return plain(self.valid) & (ts - ts[0] <= share * (ts[-1] - ts[0]))

    def padded(self, count: int) -> "Recording":
        """The recording with samples after its end, which do not count, up to a number of them:
        recordings of one length share one compiled program.
        """
        more = count - self.ts.shape[0]
        if more <= 0:
            return self
        ts, values, valid = (plain(x) for x in (self.ts, self.values, self.valid))
        xp = namespace(ts, values, valid)
        beyond = xp.arange(1, more + 1, dtype=ts.dtype)
        later = ts[-1] + _PADDING * (ts[-1] - ts[-2]) * beyond
        return Recording(
            xp.concatenate([ts, later]),
            xp.pad(values, (0, more), mode="edge"),
            self.quantity,
            xp.pad(valid, (0, more)),
        )

    @property
    def observations(self) -> Int[AnyArray, "..."]:
        """How many samples count."""
        return self.valid.sum(axis=-1)


class ImpactTimes(eqx.Module):
    """The times of successive impacts, as heard or seen.

    **Arguments:**

    - `times`: strictly increasing [s].
    - `valid`: which of them count; all if left out. An impact that was missed has a row that does
      not, so that those after it keep their number; NaN does not count either. The first impact is
      one whose time is known.

    **Raises** `ValueError` for lists that are empty or not of one length, and for times that do not
    increase.
    """

    times: Float[Array, " impacts"]
    valid: Valid

    def __init__(self, times: ArrayLike, valid: ArrayLike | None = None) -> None:
        self.times = as_parameter(times)
        _check_list("times", self.times, self.times.shape)
        self.valid = _counted(self.times, valid)
        if not isinstance(self.times, Tracer):
            times = np.asarray(self.times)
            if not np.isfinite(times[0]):
                raise ValueError("The first of the impact times has to be known: begin with it.")
            _check_increasing("times", times[np.isfinite(times)])

    def padded(self, count: int) -> "ImpactTimes":
        """The impact times with later ones, unknown, up to a number of them."""
        times, valid = plain(self.times), plain(self.valid)
        xp, more = namespace(times, valid), max(count - times.shape[0], 0)
        unknown = xp.pad(times, (0, more), constant_values=np.nan)
        return ImpactTimes(unknown, xp.pad(valid, (0, more)))

    @property
    def last(self) -> Float[Array, ""]:
        """The latest time that is known [s]."""
        return jnp.nanmax(self.times)

    def first(self, share: float) -> "ImpactTimes":
        """The impacts with only those in the first part of the time counted."""
        return ImpactTimes(self.times, self.within(share))

    def within(self, share: float) -> Valid:
        """Which impacts count in the first part of the time."""
        times = plain(self.times)
        last = namespace(times).nanmax(times)
        return plain(self.valid) & (times - times[0] <= share * (last - times[0]))

    @property
    def observations(self) -> Int[AnyArray, "..."]:
        """How many impacts count."""
        return self.valid.sum(axis=-1)


AnyRecording = Recording | ImpactTimes


def _check_list(name: str, values: Array, shape: tuple[int, ...]) -> None:
    if values.ndim != 1 or values.size == 0:
        raise ValueError(
            f"Argument `{name}` must be a list of at least one number, but its shape is "
            f"{values.shape}."
        )
    if values.shape != shape:
        raise ValueError(
            f"There are {values.shape[0]} `{name}` for {shape[0]} times; there must be as many."
        )


def _check_increasing(name: str, times: Array | np.ndarray) -> None:
    if isinstance(times, Tracer):
        return
    wrong = ~(np.diff(np.asarray(times)) > 0)
    if wrong.any():
        where = int(np.argmax(wrong))
        raise ValueError(
            f"Argument `{name}` must increase strictly, but {times[where + 1]} follows "
            f"{times[where]}."
        )


def _counted(values: Array, valid: ArrayLike | None) -> Valid:
    finite = abs(plain(values)) < np.inf
    if valid is None:
        return jnp.asarray(finite)
    mask = plain(jnp.asarray(valid))
    if mask.dtype != bool or mask.shape != values.shape:
        raise ValueError(
            f"Argument `valid` must be true or false for each of {len(values)} observations, but "
            f"it is {mask.dtype} of shape {mask.shape}."
        )
    return jnp.asarray(finite & mask)
