"""What was measured."""

import equinox as eqx
from jaxtyping import Array, Float

from impactjax._measure.quantity import AbstractQuantity
from impactjax._types import Samples


class Recording(eqx.Module):
    """A quantity sampled in time.

    - `ts`: strictly increasing [s].
    - `values`: in the quantity's SI unit.
    - `quantity`: what was observed.
    """

    ts: Samples
    values: Samples
    quantity: AbstractQuantity


class ImpactTimes(eqx.Module):
    """The times of successive impacts, as heard or seen.

    - `times`: strictly increasing [s].
    """

    times: Float[Array, " impacts"]


AnyRecording = Recording | ImpactTimes
