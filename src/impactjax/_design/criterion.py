"""Criteria of a design: one number for the errors that a plan leaves."""

import abc
import math
from collections.abc import Mapping, Sequence

import equinox as eqx
import numpy as np
from jaxtyping import Float

from impactjax._fit.quantiles import NORMAL
from impactjax._known import AnyArray
from impactjax._refusal import as_names

Covariances = Float[AnyArray, "... models parameters parameters"]
Losses = Float[AnyArray, "..."]


class AbstractCriterion(eqx.Module):
    """A convex function of the information, which is smaller for a better plan. It sees the
    covariance of the relative errors of the parameters, for each model that is thought possible.
    """

    @abc.abstractmethod
    def parameters(self, names: Sequence[str]) -> tuple[str, ...]:
        """The parameters that count, of those in the model."""

    @abc.abstractmethod
    def loss(self, covariances: Covariances) -> Losses:
        """The loss, from the covariances of the parameters that count."""

    @abc.abstractmethod
    def slope(self, covariances: Covariances) -> Covariances:
        """The derivative of the loss by the covariances of the parameters that count."""

    @abc.abstractmethod
    def size(self, loss: float) -> float:
        """The loss as a relative standard error [1]; as a ratio to what was asked if there is a
        goal.
        """

    def asked_widths(self) -> dict[str, float]:
        """The relative half-widths that a goal asks for; none without a goal."""
        return {}

    @property
    def goal(self) -> float:
        """The loss that is small enough; −∞ if a smaller one is always better."""
        return 1.0 if self.asked_widths() else -math.inf


class DOptimal(AbstractCriterion):
    """The volume of the joint confidence region: the mean over the models of log det C / p, with
    the covariance C of the relative errors of p parameters.

    **Arguments:**

    - `names`: the parameters that count; all of the model if empty.

    Source: V. V. Fedorov (1972), "Theory of optimal experiments", Academic Press.
    """

    names: tuple[str, ...] = eqx.field(converter=lambda given: _as_names(given), default=())

    def parameters(self, names: Sequence[str]) -> tuple[str, ...]:
        return self.names or tuple(names)

    def loss(self, covariances: Covariances) -> Losses:
        _, logs = np.linalg.slogdet(covariances)
        return logs.mean(axis=-1) / covariances.shape[-1]

    def slope(self, covariances: Covariances) -> Covariances:
        models, count = covariances.shape[-3], covariances.shape[-1]
        return np.linalg.inv(covariances) / (models * count)

    def size(self, loss: float) -> float:
        return math.exp(loss / 2)


class AOptimal(AbstractCriterion):
    """The mean square of the relative errors: the mean over the models of tr C / p.

    **Arguments:**

    - `names`: the parameters that count; all of the model if empty.
    """

    names: tuple[str, ...] = eqx.field(converter=lambda given: _as_names(given), default=())

    def parameters(self, names: Sequence[str]) -> tuple[str, ...]:
        return self.names or tuple(names)

    def loss(self, covariances: Covariances) -> Losses:
        return _variances(covariances).mean(axis=(-2, -1))

    def slope(self, covariances: Covariances) -> Covariances:
        models, count = covariances.shape[-3], covariances.shape[-1]
        return np.broadcast_to(np.eye(count), covariances.shape) / (models * count)

    def size(self, loss: float) -> float:
        return math.sqrt(loss)


class WorstParameter(AbstractCriterion):
    """The largest relative error: the mean over the models of max Cᵢᵢ.

    **Arguments:**

    - `names`: the parameters that count; all of the model if empty.
    """

    names: tuple[str, ...] = eqx.field(converter=lambda given: _as_names(given), default=())

    def parameters(self, names: Sequence[str]) -> tuple[str, ...]:
        return self.names or tuple(names)

    def loss(self, covariances: Covariances) -> Losses:
        return _variances(covariances).max(axis=-1).mean(axis=-1)

    def slope(self, covariances: Covariances) -> Covariances:
        variances = _variances(covariances)
        worst = np.eye(variances.shape[-1])[variances.argmax(axis=-1)]
        return worst[..., None] * np.eye(variances.shape[-1]) / variances.shape[-2]

    def size(self, loss: float) -> float:
        return math.sqrt(loss)


class Within(AbstractCriterion):
    """A goal: 95 % intervals of half a width relative to the parameter's value, for every model
    that is thought possible. `Within({"k": 0.05})` asks for k within 5 %.

    **Arguments:**

    - `asked`: largest relative half-widths, by parameter.

    **Raises** `ValueError` for no parameter, and for a half-width that is not positive.
    """

    asked: tuple[tuple[str, float], ...] = eqx.field(converter=lambda given: _as_asked(given))

    def parameters(self, names: Sequence[str]) -> tuple[str, ...]:
        del names
        return tuple(name for name, _ in self.asked)

    def loss(self, covariances: Covariances) -> Losses:
        return (_variances(covariances) * self._weights).max(axis=(-2, -1))

    def slope(self, covariances: Covariances) -> Covariances:
        ratios = _variances(covariances) * self._weights
        worst = (ratios == ratios.max(axis=(-2, -1), keepdims=True)) * self._weights
        return worst[..., None] * np.eye(worst.shape[-1]) / np.count_nonzero(worst)

    def asked_widths(self) -> dict[str, float]:
        return dict(self.asked)

    def size(self, loss: float) -> float:
        return math.sqrt(loss)

    @property
    def _weights(self) -> np.ndarray:
        return (NORMAL / np.array([width for _, width in self.asked])) ** 2


def scale_of(value: float) -> float:
    """The unit of a relative error: the size of a value, or 1 for a parameter at zero."""
    return abs(value) or 1.0


def half_widths(errors: Losses) -> Losses:
    """Half-widths of 95 % intervals from standard errors."""
    return NORMAL * errors


def _variances(covariances: Covariances) -> Float[AnyArray, "... models parameters"]:
    return np.diagonal(covariances, axis1=-2, axis2=-1)


def _as_names(given: Sequence[str]) -> tuple[str, ...]:
    names = as_names("names", given)
    if len({*names}) < len(names):
        raise ValueError(f"A parameter is named twice: {', '.join(names)}.")
    return names


def _as_asked(
    given: Mapping[str, float] | tuple[tuple[str, float], ...],
) -> tuple[tuple[str, float], ...]:
    if not isinstance(given, Mapping | tuple):
        raise TypeError(f'A goal is a table, as in Within({{"k": 0.05}}), but it is {given!r}.')
    as_names("asked", [*dict(given)])
    for name, width in dict(given).items():
        if not isinstance(width, int | float):
            raise TypeError(f"The half-width asked of `{name}` must be a number, but is {width!r}.")
    asked = tuple((name, float(width)) for name, width in dict(given).items())
    if not asked:
        raise ValueError('A goal names at least one parameter, as in Within({"k": 0.05}).')
    for name, width in asked:
        if not 0 < width < math.inf:
            raise ValueError(f"The half-width asked of `{name}` must be positive, but is {width}.")
    return asked
