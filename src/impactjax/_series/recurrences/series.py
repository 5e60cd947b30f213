"""Power series that grow by one coefficient at a time."""

import functools
from collections.abc import Callable, Sequence
from typing import TypeAlias, final

import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.extend.core import JaxprEqn
from jaxtyping import Array, ArrayLike

Series: TypeAlias = list[Array]  # the coefficients so far, in order
Operand: TypeAlias = Series | Array | float  # a series, or a value that time does not change
Program: TypeAlias = list[Callable[[int], None]]  # each appends a coefficient of order k
Rule: TypeAlias = Callable[[JaxprEqn, list[Operand], Program], Sequence[Operand]]


def elementwise(function: Callable[..., Series]) -> Rule:
    """The rule of a primitive without parameters, `function(program, *operands)`."""

    def rule(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
        del equation
        return [function(program, *operands)]

    return rule


class NotAnalytic(ValueError):  # noqa: N818  it is a property of the equations, as the name says
    """The equations of motion hold an operation that has no Taylor recurrence here."""


def refusal(primitive: str) -> NotAnalytic:
    """The error for an operation without a recurrence."""
    return NotAnalytic(
        f"Operation `{primitive}` in the equations of motion has no Taylor recurrence; "
        "simulate with a Runge-Kutta step instead, `step=RungeKutta()`."
    )


@final
class OnDemand(list[Array]):
    """A series that computes a coefficient only when it is asked for."""

    def __init__(self, rule: Callable[[int], Array]) -> None:
        self._rule = rule

    def __getitem__(self, k: int) -> Array:  # pyright: ignore[reportIncompatibleMethodOverride]
        while len(self) <= k:
            self.append(self._rule(len(self)))
        return list.__getitem__(self, k)


def at(operand: Operand, k: int, like: Array) -> Array:
    """The coefficient of order k of a series or a constant."""
    if isinstance(operand, list):
        return operand[k]
    value = jnp.asarray(operand, like.dtype)
    return value if k == 0 else jnp.zeros_like(value)


def all_at(operands: Sequence[Operand], k: int) -> list[Array]:
    """The coefficients of order k of several operands, at least one of which is a series."""
    like = next(operand[0] for operand in operands if isinstance(operand, list))
    return [at(operand, k, like) for operand in operands]


def start(operand: Operand) -> Array | float:
    """The value of an operand at the point of expansion."""
    return operand[0] if isinstance(operand, list) else operand


def grown(program: Program, rule: Callable[[int], Array]) -> Series:
    """A series whose coefficient of order k is `rule(k)`."""
    series: Series = []
    program.append(lambda k: series.append(rule(k)))
    return series


def several_grown(
    program: Program, count: int, rule: Callable[[int], Sequence[Array]]
) -> list[Series]:
    """Several series, whose coefficients of order k are `rule(k)`."""
    several: list[Series] = [[] for _ in range(count)]

    def extend(k: int) -> None:
        for series, coefficient in zip(several, rule(k), strict=True):
            series.append(coefficient)

    program.append(extend)
    return several


def derivative(program: Program, operand: Series) -> Series:
    """J aⱼ at position j − 1; short of the last coefficient by one while the series grow."""
    slope: Series = []

    def extend(k: int) -> None:
        if k > 0:
            slope.append(times(k, operand[k]))

    program.append(extend)
    return slope


# `lax` instead of operators: it traces faster, without promotion and broadcasting.


def product_coefficient(a: Series, b: Series, k: int) -> Array:
    """Cauchy's product: the coefficient of order k of a b."""
    return functools.reduce(lax.add, [lax.mul(a[j], b[k - j]) for j in range(k + 1)])


def times(number: float, value: Array) -> Array:
    """An array times a number of Python's."""
    return lax.mul(value, np.full(value.shape, number, value.dtype))


def less(value: Array, number: ArrayLike) -> Array:
    """True where a value is below a number."""
    return lax.lt(value, jnp.full_like(value, number))
