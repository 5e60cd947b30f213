"""Parameters of a model: numbers with a unit and a range."""

import dataclasses
import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float

from impactjax._known import AnyArray

_KEY = "impactjax parameter"


class Range(NamedTuple):
    """The values that a parameter may take, and their unit."""

    unit: str
    low: float  # not below this
    high: float  # not above this
    excludes_low: bool  # nor at `low` itself
    known: bool  # usually measured otherwise: a fit leaves it alone unless asked

    def holds(self, value: Float[Array, "..."]) -> Bool[Array | np.ndarray | np.bool, "..."]:
        """Whether a value is finite and in range."""
        number = plain(value)
        above = number > self.low if self.excludes_low else number >= self.low
        return (abs(number) < math.inf) & above & (number <= self.high)

    def describe(self) -> str:
        """What must be, as in "must be ..."."""
        if self.low == -math.inf and self.high == math.inf:
            return "finite"
        if self.high == math.inf:
            kind = "greater than" if self.excludes_low else "at least"
            return f"finite and {kind} {self.low:g}"
        return f"from {self.low:g} to {self.high:g}"


def parameter(
    unit: str,
    *,
    above: float | None = None,
    at_least: float = -math.inf,
    at_most: float = math.inf,
    known: bool = False,
) -> dict[str, Range]:
    """Metadata of a field that holds a parameter:
    `eqx.field(converter=as_parameter, metadata=parameter("rad/s", above=0))`.

    The range is checked where the object is made, becomes a result code under `jit`, and bounds a
    fit.

    **Arguments:**

    - `unit`: such as "rad/s"; "1" for a pure number.
    - `above`, `at_least`, `at_most`: the range.
    - `known`: whether it is usually measured otherwise, so that a fit leaves it alone.
    """
    low = at_least if above is None else above
    return {_KEY: Range(unit, low, at_most, excludes_low=above is not None, known=known)}


def as_parameter(value: ArrayLike) -> Float[Array, "..."]:
    """A number as a floating-point array, so that its value never causes a retrace."""
    array = jnp.asarray(value)
    if jnp.issubdtype(array.dtype, jnp.complexfloating):
        raise ValueError(f"A number must be real, but it is of type {array.dtype}.")
    if not jnp.issubdtype(array.dtype, jnp.inexact):
        array = array.astype(jnp.result_type(float))
    return array


def plain(value: AnyArray) -> AnyArray:
    """A known number as NumPy's, with which no operation is compiled."""
    return value if isinstance(value, Tracer) else np.asarray(value)


def as_optional_parameter(value: ArrayLike | None) -> Float[Array, "..."] | None:
    """As `as_parameter`; `None` leaves a part of the physics out."""
    return None if value is None else as_parameter(value)


def ranges(part: eqx.Module) -> dict[str, Range]:
    """The parameters among the fields of a part of a model, those that are `None` left out."""
    return {
        field.name: field.metadata[_KEY]
        for field in dataclasses.fields(part)
        if _KEY in field.metadata and getattr(part, field.name) is not None
    }


def parameter_of(field: dataclasses.Field) -> Range | None:
    """The unit and range of a field, if it holds a parameter."""
    return field.metadata.get(_KEY)


class Requirement(NamedTuple):
    """A condition on parameters, and the sentence to say when it does not hold."""

    holds: Bool[Array | np.ndarray | np.bool, "..."]
    sentence: str


def range_requirements(part: eqx.Module) -> list[Requirement]:
    """The requirements that each parameter of a part is in its range."""
    return [_in_range(name, getattr(part, name), allowed) for name, allowed in ranges(part).items()]


def is_positive(name: str, value: Float[Array, "..."]) -> Requirement:
    """The requirement that an argument is a finite number greater than zero."""
    return _in_range(name, value, Range("", 0.0, math.inf, excludes_low=True, known=False))


def _in_range(name: str, value: Float[Array, "..."], allowed: Range) -> Requirement:
    return Requirement(allowed.holds(value), f"Argument `{name}` must be {allowed.describe()}")


def raise_if_violated(owner: eqx.Module, requirements: list[Requirement]) -> None:
    """Raises `ValueError` for the first requirement that is known not to hold.

    Traced values are let through: under `jit` they become a result code of the lane.
    """
    for holds, sentence in requirements:
        if not isinstance(holds, Tracer) and not np.all(holds):
            raise ValueError(f"{type(owner).__name__}: {sentence}.")


def require_restitution(r: ArrayLike, *, zero: bool) -> None:
    """Refuses a known coefficient of restitution outside 0 to 1, or of `zero` unless allowed."""
    if isinstance(r, Tracer):
        return
    number = np.asarray(r)
    above = number >= 0 if zero else number > 0
    if not np.all(above & (number <= 1)):
        range_ = "from 0 to 1" if zero else "above 0 and at most 1"
        raise ValueError(f"Argument `r` must be {range_}, but it is {r}.")
