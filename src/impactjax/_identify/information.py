"""Fisher information in data about parameters."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Float

from impactjax._identify.directions import Directions, Sensitivities, directions, spread, without
from impactjax._known import AnyArray, known, namespace
from impactjax._problem.parameters import Handle
from impactjax._refusal import as_names

PerParameter = Float[AnyArray, " parameters"]
PerPair = Float[AnyArray, "parameters parameters"]

_NOTHING = 0.1  # ratio of a positive parameter to its error below which its logarithm is useless
_ROUNDING = 64  # roundings of the largest effect that count as none
_ACCOMPANYING = ("initial", "start", "sensor")  # nuisance parameters


class About(NamedTuple):
    """Names and kinds of parameters, as in `Information`."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    positive: tuple[bool, ...]
    of_model: tuple[bool, ...]


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

    def collinearity(self, names: Sequence[str]) -> Float[AnyArray, ""]:
        """The collinearity index of some parameters, 1/√λ with the smallest eigenvalue λ of the
        information with a unit diagonal: a change of one of them can be compensated by the others
        up to a part 1/index. It is 1 for orthogonal sensitivities; above 10 to 15 the parameters
        are hardly distinguished [1].

        Source: R. Brun, P. Reichert and H. R. Künsch (2001), Water Resources Research 37, 1015.
        """
        names = as_names("names", names)
        if not names:
            raise ValueError("Argument `names` must be a list of at least one name.")
        for name in names:
            if name not in self.names:
                have = ", ".join(self.names)
                raise ValueError(f"There is no parameter `{name}`; there are {have}.")
        xp = namespace(self.sensitivities)
        columns = self.sensitivities[:, np.array([self.names.index(name) for name in names], int)]
        lengths = xp.linalg.norm(columns, axis=0)
        errors = spread(columns / xp.where(lengths > 0, lengths, 1.0)).errors
        return xp.where(xp.isfinite(columns).all(), xp.max(errors), xp.nan)


def informed(
    parameters: dict[str, Handle], values: PerParameter, jacobian: Sensitivities
) -> Information:
    """The information in a Jacobian of the data divided by their noise, by each parameter."""
    about = About(
        tuple(parameters),
        tuple(each.allowed.unit for each in parameters.values()),
        tuple(each.allowed.low >= 0 for each in parameters.values()),
        tuple(each.path[0] not in _ACCOMPANYING for each in parameters.values()),
    )
    return scaled(about, values, jacobian)


@np.errstate(all="ignore")  # no warnings, as in JAX
def scaled(about: About, values: PerParameter, jacobian: Sensitivities) -> Information:
    """The information in a Jacobian of the data divided by their noise, by each parameter."""
    values, jacobian = known(values), known(jacobian)
    xp = namespace(values, jacobian)
    effect = xp.linalg.norm(jacobian, axis=0) * xp.where(values != 0, xp.abs(values), 1.0)
    only_rounding = effect < _ROUNDING * xp.finfo(jacobian.dtype).eps * xp.max(effect)
    jacobian = xp.where(only_rounding, 0.0, jacobian)
    size = xp.linalg.norm(jacobian, axis=0)
    alone = xp.where(size > 0, 1 / xp.where(size > 0, size, 1.0), 0.0)
    below = xp.where(np.array(about.positive), _NOTHING * alone, alone)
    large = xp.where(xp.abs(values) < below, alone, xp.abs(values))
    scale = xp.where(large > 0, large, xp.where(alone > 0, alone, 1.0))
    return Information(*about, values, scale, jacobian * scale)
