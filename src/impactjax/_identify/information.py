"""What data tell about parameters: the verb `information` and what it returns."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from impactjax._identify.directions import Directions, Sensitivities, directions, spread, without
from impactjax._identify.parameters import chosen
from impactjax._known import AnyArray, known, namespace
from impactjax._problem.parameters import Handle, with_values

Part = TypeVar("Part", bound=eqx.Module)
PerParameter = Float[AnyArray, " parameters"]
PerPair = Float[AnyArray, "parameters parameters"]

_NOTHING = 0.1  # of that error: a positive parameter's logarithm means nothing any more
_ACCOMPANYING = ("initial", "start", "sensor")  # found with the model, but not what is asked for


class Information(eqx.Module):
    """What data tell about parameters, to first order around the parameters' values.

    A parameter p counts in units of its own size, u = p / scale, so that for a positive one du is a
    step of its logarithm, unless it is next to nothing. With S = ∂(data/σ)/∂u the Fisher
    information is Sᵀ S.

    - `names`, `units`: of the parameters.
    - `positive`: whether a parameter cannot be negative.
    - `of_model`: whether it belongs to the model, and not to the initial state or the sensor.
    - `values`: in the parameters' own units.
    - `scale`: |value|; the error that it would have if all others were known, if that is larger, or
      for a positive one larger by far.
    - `sensitivities`: S, change of the data in sizes of their noise per relative change of a
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
        """The Cramér-Rao bound of each parameter: no unbiased estimate has a smaller standard
        error. Infinite for one that the data do not tell. In the parameter's own unit.
        """
        unit = namespace(self.scale).eye(len(self.names), dtype=self.scale.dtype)
        return spread(self.sensitivities).error(unit) * self.scale

    @property
    @np.errstate(all="ignore")
    def correlation(self) -> PerPair:
        """Correlation of the errors; ±1 for parameters that the data tell only together [1]."""
        told, xp = spread(self.sensitivities), namespace(self.scale)
        most = 1 / xp.finfo(self.scale.dtype).eps
        weighted = told.axes.T * xp.minimum(told.errors, most)
        covariance = weighted @ weighted.T
        errors = xp.sqrt(xp.diagonal(covariance))
        return covariance / (errors[:, None] * errors[None, :])

    @property
    def directions(self) -> Directions:
        """Stiff and sloppy directions among the model's parameters while the others, of initial
        state and sensor, are found from the same data.
        """
        own = np.array([i for i, asked in enumerate(self.of_model) if asked], int)
        other = np.array([i for i, asked in enumerate(self.of_model) if not asked], int)
        names = tuple(name for name, asked in zip(self.names, self.of_model, strict=True) if asked)
        left = without(self.sensitivities[:, own], self.sensitivities[:, other])
        return directions(names, left, spread(self.sensitivities).part(own))


def information(
    data: Callable[[Part], Array],
    part: Part,
    sigma: ArrayLike,
    *,
    free: Sequence[str] = (),
    fixed: Sequence[str] = (),
) -> Information:
    """What data would tell about the parameters of a law, a model or any part of it.

    Works under `jit` and `vmap`. Source of the terms: Transtrum et al., J. Chem. Phys. 143, 010901
    (2015).

    **Arguments:**

    - `data`: the data as a differentiable function of the part: speeds, durations, a motion.
    - `part`: with the values around which to ask.
    - `sigma`: standard deviation of the data's noise, one number or one for each.
    - `free`: names of parameters to ask for although they are usually known.
    - `fixed`: names of parameters to take as known.

    **Raises** `ValueError` for a name that the part does not have, and if no parameter is left.
    """
    parameters = chosen(part, free, fixed)
    values = jnp.stack([each.get(part) for each in parameters.values()])
    noise = jnp.asarray(sigma, values.dtype)

    def scaled(values: PerParameter) -> Float[AnyArray, " data"]:
        return jnp.ravel(data(with_values(part, [*parameters.values()], list(values))) / noise)

    return informed(parameters, values, jax.jacfwd(scaled)(values))


@np.errstate(all="ignore")  # as JAX computes, without a warning
def informed(
    parameters: dict[str, Handle], values: PerParameter, jacobian: Sensitivities
) -> Information:
    """The information of a Jacobian in sizes of the noise per unit of each parameter."""
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
