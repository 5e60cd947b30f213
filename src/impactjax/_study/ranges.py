"""Ranges of the parameters of a sample."""

import abc
import math
from collections.abc import Mapping
from typing import TypeAlias

import equinox as eqx
import numpy as np
from jaxtyping import Float

from impactjax._refusal import as_names, check_number
from impactjax._study.design import Points

Quantiles: TypeAlias = Float[np.ndarray, " lanes"]


class AbstractRange(eqx.Module):
    """The distribution of a parameter over a range."""

    low: eqx.AbstractVar[float]
    high: eqx.AbstractVar[float]

    @abc.abstractmethod
    def quantiles(self, u: Quantiles) -> Quantiles:
        """Values below which the parameter lies with probability u."""


class Uniform(AbstractRange):
    """A range in which all values are equally likely."""

    low: float
    high: float

    def __check_init__(self) -> None:
        if not -math.inf < self.low < self.high < math.inf:
            raise ValueError(f"A range must increase, but it is from {self.low} to {self.high}.")

    def quantiles(self, u: Quantiles) -> Quantiles:
        """The values low + (high - low) u."""
        return self.low + (self.high - self.low) * u


class LogUniform(AbstractRange):
    """A range of a positive parameter in which all values of its logarithm are equally likely.

    **Arguments:**

    - `low`, `high`: its ends, in the parameter's unit.
    """

    low: float
    high: float

    def __check_init__(self) -> None:
        check_number("low", self.low)
        check_number("high", self.high)
        if not 0 < self.low < self.high < math.inf:
            raise ValueError(
                f"A logarithmic range must increase from above zero, but it is from {self.low} to "
                f"{self.high}."
            )

    def quantiles(self, u: Quantiles) -> Quantiles:
        """The values low (high/low)^u."""
        return self.low * (self.high / self.low) ** u


Ranges: TypeAlias = Mapping[str, AbstractRange]


def as_ranges(ranges: Mapping[str, object]) -> Ranges:
    """Ranges by name of the parameter, where a pair (low, high) is a uniform one."""
    if not isinstance(ranges, Mapping) or not ranges:
        raise ValueError(
            'Argument `ranges` must name at least one parameter: `{"gamma": (0.1, 0.3)}`.'
        )
    return {name: _as_range(name, ranges[name]) for name in as_names("ranges", [*ranges])}


def _as_range(name: str, given: object) -> AbstractRange:
    if isinstance(given, AbstractRange):
        return given
    if isinstance(given, tuple | list) and len(given) == 2:
        low, high = given
        if isinstance(low, int | float) and isinstance(high, int | float):
            return Uniform(float(low), float(high))
    raise ValueError(
        f"The range of `{name}` must be two numbers (low, high) or `LogUniform(low, high)`, but it "
        f"is {given!r}."
    )


def scaled(ranges: Ranges, cube: Points) -> Points:
    """Points of the unit cube, as values of the parameters."""
    return np.stack([each.quantiles(cube[:, i]) for i, each in enumerate(ranges.values())], axis=1)
