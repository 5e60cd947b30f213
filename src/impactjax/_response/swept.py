"""A forced system as a function of one of its parameters."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from impactjax._hybrid.arguments import real
from impactjax._response.forced import Forced
from impactjax._response.parameter import with_value
from impactjax._response.sampler import Growth, Sampled
from impactjax._types import Numbers, Scalar


class Swept(eqx.Module):
    """A forced system as a function of one of its parameters."""

    forced: Forced
    place: int = eqx.field(static=True)

    def at(self, value: Scalar) -> eqx.Module:
        """The system at one value."""
        return with_value(self.forced.system, self.place, value)

    def begun(self, value: Scalar) -> PyTree:
        """The start of a motion at one value."""
        return self.forced.run.begun(self.at(value), self.forced.start)

    def states(self, value: Scalar, begun: PyTree) -> Sampled:
        """The states at one value."""
        return self.forced.run(self.at(value), begun)

    def growth(self, value: Scalar) -> Growth:
        """The growth of disturbances at one value."""
        return self.forced.run.growth(self.at(value), self.begun(value))


def as_values(values: Numbers) -> Float[Array, " values"]:
    """The values of a parameter.

    **Raises** `ValueError` for what is not a row of numbers.
    """
    at = jnp.atleast_1d(jnp.asarray(real("values", values), float))
    if at.ndim != 1 or not at.size:
        raise ValueError(
            f"Argument `values` must be a row of numbers, but its shape is {at.shape}."
        )
    return at
