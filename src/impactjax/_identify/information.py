"""The verb `information`: Fisher information in data about parameters."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._identify.directions import Directions, Sensitivities, directions, spread, without
from impactjax._identify.parameters import chosen
from impactjax._known import AnyArray, is_known, known, namespace
from impactjax._problem.parameters import Handle, with_values
from impactjax._types import Numbers

Part = TypeVar("Part", bound=eqx.Module)
PerParameter = Float[AnyArray, " parameters"]
PerPair = Float[AnyArray, "parameters parameters"]

_NOTHING = 0.1  # ratio of a positive parameter to its error below which its logarithm is useless
_ACCOMPANYING = ("initial", "start", "sensor")  # nuisance parameters


class Information(eqx.Module):
    """Fisher information in data about parameters, to first order around the parameters' values.

    Parameters are scaled, u = p / scale; for a positive one of normal size du is a step of its
    logarithm. With S = ∂(data/σ)/∂u the Fisher information is Sᵀ S.

    - `names`, `units`: names and units of the parameters.
    - `positive`: true for a parameter that cannot be negative.
    - `of_model`: true for a parameter of the model, false for one of initial state or sensor.
    - `values`: values in the parameters' own units.
    - `scale`: |value|, or the parameter's error with all others known, if that is larger (for a
      positive one, more than ten times as large).
    - `sensitivities`: S, change of the data divided by their noise per relative change of a
      parameter [1].
    """

    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    positive: tuple[bool, ...] = eqx.field(static=True)
    of_model: tuple[bool, ...] = eqx.field(static=True)
    values: PerParameter
    scale: PerParameter
    sensitivities: Sensitivities

    @property
    def matrix(self) -> PerPair:
        """The Fisher information Sᵀ S of the scaled parameters [1]."""
        return self.sensitivities.T @ self.sensitivities

    @property
    def bounds(self) -> PerParameter:
        """The Cramér-Rao bound of each parameter, in its own unit: no unbiased estimate has a
        smaller standard error. Infinite for a parameter that the data do not determine.
        """
        unit = namespace(self.scale).eye(len(self.names), dtype=self.scale.dtype)
        return spread(self.sensitivities).error(unit) * self.scale

    @property
    @np.errstate(all="ignore")
    def correlation(self) -> PerPair:
        """Correlation of the errors; ±1 for parameters that are determined only jointly [1]."""
        told, xp = spread(self.sensitivities), namespace(self.scale)
        most = 1 / xp.finfo(self.scale.dtype).eps
        weighted = told.axes.T * xp.minimum(told.errors, most)
        covariance = weighted @ weighted.T
        errors = xp.sqrt(xp.diagonal(covariance))
        return covariance / (errors[:, None] * errors[None, :])

    @property
    def directions(self) -> Directions:
        """Stiff and sloppy directions among the model's parameters, with those of initial state and
        sensor estimated from the same data.
        """
        own = np.array([i for i, asked in enumerate(self.of_model) if asked], int)
        other = np.array([i for i, asked in enumerate(self.of_model) if not asked], int)
        names = tuple(name for name, asked in zip(self.names, self.of_model, strict=True) if asked)
        left = without(self.sensitivities[:, own], self.sensitivities[:, other])
        return directions(names, left, spread(self.sensitivities).part(own))


def information(
    data: Callable[[Part], Array],
    part: Part,
    sigma: Numbers,
    *,
    free: Sequence[str] = (),
    fixed: Sequence[str] = (),
) -> Information:
    """Fisher information that data would contain about the parameters of a law, a model or any
    part of it.

    Works under `jit` and `vmap`. Source of the terms: Transtrum et al., J. Chem. Phys. 143, 010901
    (2015).

    **Arguments:**

    - `data`: differentiable function from the part to the data: speeds, durations, a motion.
    - `part`: law, model or system, with the values around which to linearise.
    - `sigma`: standard deviation of the data's noise, one number or one for each datum.
    - `free`: names of parameters to include although they are usually known.
    - `fixed`: names of parameters to take as known.

    **Raises** `ValueError` for a name that the part does not have or that is in both lists, for a
    known `sigma` that is not positive, and if no parameter is left.
    """
    if both := sorted({*free} & {*fixed}):
        raise ValueError(f"`{both[0]}` is in both `free` and `fixed`.")
    if is_known(sigma) and not np.all(np.asarray(sigma) > 0):
        raise ValueError(f"Argument `sigma` must be positive, but it is {sigma}.")
    parameters = chosen(part, free, fixed)
    values = jnp.stack([each.get(part) for each in parameters.values()])
    noise = jnp.asarray(sigma, values.dtype)

    def scaled(values: PerParameter) -> Float[AnyArray, " data"]:
        return jnp.ravel(data(with_values(part, [*parameters.values()], list(values))) / noise)

    return informed(parameters, values, jax.jacfwd(scaled)(values))


@np.errstate(all="ignore")  # no warnings, as in JAX
def informed(
    parameters: dict[str, Handle], values: PerParameter, jacobian: Sensitivities
) -> Information:
    """The information in a Jacobian of the data divided by their noise, by each parameter."""
    values, jacobian = known(values), known(jacobian)
    xp = namespace(values, jacobian)
    positive = tuple(each.allowed.low >= 0 for each in parameters.values())
    size = xp.linalg.norm(jacobian, axis=0)
    alone = xp.where(size > 0, 1 / xp.where(size > 0, size, 1.0), 0.0)
    below = xp.where(np.array(positive), _NOTHING * alone, alone)
    large = xp.where(xp.abs(values) < below, alone, xp.abs(values))
    scale = xp.where(large > 0, large, xp.where(alone > 0, alone, 1.0))
    return Information(
        names=tuple(parameters),
        units=tuple(each.allowed.unit for each in parameters.values()),
        positive=positive,
        of_model=tuple(each.path[0] not in _ACCOMPANYING for each in parameters.values()),
        values=values,
        scale=scale,
        sensitivities=jacobian * scale,
    )
