"""Period of the force on a system, as a function of the system."""

from collections.abc import Callable
from typing import Any, TypeAlias

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

from impactjax._hybrid.arguments import as_number
from impactjax._known import is_known
from impactjax._refusal import returned_number

Force: TypeAlias = Callable[[Any], ArrayLike]  # of a system of the caller's class
Period: TypeAlias = ArrayLike | Force


class Fixed(eqx.Module):
    """A period that does not depend on the system."""

    value: Array

    def __call__(self, system: eqx.Module) -> Array:
        del system
        return self.value


def as_function(period: Period, system: eqx.Module) -> Force:
    """A period as a function of the system.

    **Raises** `ValueError` for one that is not positive.
    """
    if not callable(period):
        period = Fixed(jnp.asarray(as_number("period", period), float))
    value = as_number("period", returned_number("period", period(system)))
    if is_known(value) and not (jnp.isfinite(value) & (value > 0)):
        raise ValueError(f"Argument `period` must be positive and finite, but it is {value}.")
    return period
