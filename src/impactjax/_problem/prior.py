"""Prior distributions of parameters."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._parameter import Requirement, as_parameter, is_positive, raise_if_violated
from impactjax._shown import with_numbers
from impactjax._types import Scalar


class Normal(eqx.Module):
    """Normal prior distribution of a parameter.

    **Arguments:**

    - `mean`, `sigma`: mean and standard deviation, in the parameter's unit.
    """

    mean: Float[Array, "..."] = eqx.field(converter=as_parameter)
    sigma: Float[Array, "..."] = eqx.field(converter=as_parameter)

    def __check_init__(self) -> None:
        mean = Requirement(jnp.isfinite(self.mean), "Argument `mean` must be finite")
        raise_if_violated(self, [mean, is_positive("sigma", self.sigma)])

    def log_density(self, value: Scalar) -> Scalar:
        """Logarithm of the density of a value, up to a constant."""
        return -(((value - self.mean) / self.sigma) ** 2) / 2

    __repr__ = with_numbers
