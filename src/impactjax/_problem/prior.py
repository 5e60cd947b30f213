"""Prior distributions of parameters, each like a further measurement of one of them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._known import AnyArray, known, namespace
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


class PriorRows(NamedTuple):
    """Prior knowledge as observations of parameters, in units of their errors.

    - `deviations`: (value − mean)/sigma of each [1].
    - `slopes`: its derivatives by the parameters.
    """

    deviations: Float[AnyArray, " priors"]
    slopes: Float[AnyArray, "priors parameters"]

    @property
    def squares(self) -> Float[AnyArray, ""]:
        """Sum of the squared deviations [1]."""
        return (self.deviations**2).sum()


def prior_rows(
    priors: Mapping[str, Normal],
    names: Sequence[str],
    values: Float[AnyArray, " parameters"],
) -> PriorRows:
    """The rows of some priors at the values of the named parameters."""
    xp, at = namespace(values), np.array([names.index(name) for name in priors], int)
    unit = xp.asarray(np.eye(len(names))[at], values.dtype)
    if not priors:
        return PriorRows(values[at], unit)
    each = known([(prior.mean, prior.sigma) for prior in priors.values()])
    means, sigmas = (
        xp.stack([xp.asarray(x, values.dtype) for x in row]) for row in zip(*each, strict=True)
    )
    return PriorRows((values[at] - means) / sigmas, unit / sigmas[:, None])
