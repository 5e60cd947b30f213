"""A recording that is only planned."""

import jax.numpy as jnp

from impactjax._parameter import as_parameter
from impactjax._record.recording import Recording
from impactjax._sensor.abstract_quantity import AbstractQuantity
from impactjax._types import Numbers


def planned(ts: Numbers, quantity: AbstractQuantity) -> Recording:
    """A recording that is only planned: its values are zero, and count in `information` as if they
    were measured. `synthetic` gives it simulated values.

    **Arguments:**

    - `ts`: strictly increasing times of the samples [s].
    - `quantity`: quantity to record.

    **Raises** `ValueError` as `Recording` does.
    """
    times = as_parameter(ts)
    return Recording(times, jnp.zeros_like(times), quantity)
