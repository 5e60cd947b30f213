"""Parameters of a model: numbers with a unit and a range."""

import dataclasses
import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float, PyTree

from impactjax._known import AnyArray
from impactjax._types import Numbers

_KEY = "impactjax parameter"


class Range(NamedTuple):
    """The values that a parameter may take, and their unit."""

    unit: str
    low: float  # least value
    high: float  # greatest value
    excludes_low: bool  # true if `low` itself is not allowed
    known: bool  # true if usually measured separately: a fit varies it only on request
    fades: bool = False  # true if its effect goes with its inverse, and vanishes at infinity
    power: float = 1.0  # the power of it in which residuals are nearly linear

    def holds(self, value: Float[Array, "..."]) -> Bool[Array | np.ndarray | np.bool, "..."]:
        """True if a value is finite and in range."""
        number = plain(value)
        above = number > self.low if self.excludes_low else number >= self.low
        return (abs(number) < math.inf) & above & (number <= self.high)

    def describe(self) -> str:
        """The range in words, to follow "must be": "finite and at least 0", "from 0 to 1"."""
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
    fades: bool = False,
    power: float = 1.0,
) -> dict[str, Range]:
    """Metadata of a field that holds a parameter:
    `eqx.field(converter=as_parameter, metadata=parameter("rad/s", above=0))`.

    The range is checked where the object is made, becomes a result code under `jit`, and bounds a
    fit.

    **Arguments:**

    - `unit`: such as "rad/s"; "1" for a pure number.
    - `above`, `at_least`, `at_most`: the range.
    - `known`: true if it is usually measured separately, so that a fit varies it only on request.
    - `fades`: true for a positive parameter whose effect goes with its inverse, and vanishes at
      infinity, such as the cutoff of a low-pass: a fit moves the inverse.
    - `power`: the power of a positive parameter in which residuals are nearly linear: −0.4 for the
      stiffness k of a force k δ^1.5, as the duration of a contact goes with k^(−0.4). Intervals in
      linear approximation are those of this power. That of a parameter that fades is −1.

    **Raises** `ValueError` for a power that is zero or not finite, for one beside `fades`, and for
    a power other than 1 of a parameter that may be negative.
    """
    low = at_least if above is None else above
    if power == 0 or not math.isfinite(power):
        raise ValueError(f"Argument `power` must be finite and not zero, but it is {power}.")
    if fades and power != 1:
        raise ValueError("Argument `power` must be left out beside `fades`: it is −1.")
    power = -1.0 if fades else power
    if power != 1 and low < 0:
        raise ValueError(f"A parameter with the power {power} must not be negative.")
    return {_KEY: Range(unit, low, at_most, above is not None, known, fades, power)}


def as_parameter(value: Numbers) -> Float[Array, "..."]:
    """A number as a floating-point array, so that its value never causes a retrace."""
    try:
        array = jnp.asarray(value)
    except (TypeError, ValueError) as error:
        raise TypeError(f"A number must be real, but it is {value!r}.") from error
    if jnp.issubdtype(array.dtype, jnp.complexfloating):
        raise ValueError(f"A number must be real, but it is of type {array.dtype}.")
    if not jnp.issubdtype(array.dtype, jnp.inexact):
        array = array.astype(jnp.result_type(float))
    return array


def plain(value: AnyArray) -> AnyArray:
    """A known number as a NumPy array, on which no operation has to be compiled."""
    return value if isinstance(value, Tracer) else np.asarray(value)


def as_optional_parameter(value: Numbers | None) -> Float[Array, "..."] | None:
    """Converter like `as_parameter`, but `None` stays; it leaves out a physical effect."""
    return None if value is None else as_parameter(value)


def ranges(part: eqx.Module) -> dict[str, Range]:
    """The ranges of a part's parameters by field name, without those that are `None`."""
    return {
        field.name: field.metadata[_KEY]
        for field in dataclasses.fields(part)
        if _KEY in field.metadata and getattr(part, field.name) is not None
    }


def parameter_of(field: dataclasses.Field[PyTree]) -> Range | None:
    """The unit and range of a field, if it holds a parameter."""
    return field.metadata.get(_KEY)


class Requirement(NamedTuple):
    """A condition on parameters, and the error message if it does not hold."""

    holds: Bool[Array | np.ndarray | np.bool, "..."]
    sentence: str


def range_requirements(part: eqx.Module) -> list[Requirement]:
    """For each parameter of a part, the requirement to be in its range."""
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
    """Raises `ValueError` for a known coefficient of restitution below 0, above 1, or equal to 0
    unless `zero` is allowed.
    """
    if isinstance(r, Tracer):
        return
    number = np.asarray(r)
    above = number >= 0 if zero else number > 0
    if not np.all(above & (number <= 1)):
        range_ = "from 0 to 1" if zero else "above 0 and at most 1"
        raise ValueError(f"Argument `r` must be {range_}, but it is {r}.")
