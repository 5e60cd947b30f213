"""Taylor series of an ODE's solution, from the vector field itself.

The field's jaxpr is read once; each primitive has a recurrence that gives the next coefficient of
its output from the coefficients of its inputs, and the field gives the next coefficients of the
state. Source: Moore (1966); Jorba & Zou, Experimental Mathematics 14, 99 (2005).
"""

import functools
from collections.abc import Callable, Sequence
from typing import TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.core import ShapedArray
from jax.extend.core import JaxprEqn
from jaxtyping import Array, PyTree

from impactjax._simulate.jaxpr import read, unchanged
from impactjax._types import Scalar

Series: TypeAlias = list[Array]  # the coefficients so far, in order
Operand: TypeAlias = Series | Array | float  # a series, or a value that time does not change
Program: TypeAlias = list[Callable[[int], None]]  # each appends a coefficient of order k


class NotAnalytic(ValueError):  # noqa: N818  it is a property of the equations, as the name says
    """The equations of motion hold an operation that has no Taylor recurrence here."""


def solution_series(
    field: Callable[..., Sequence[Array]], t: Scalar, y: Sequence[Array], order: int, unit: Scalar
) -> tuple[list[Series], list[Series]]:
    """Taylor coefficients, in time counted in `unit`s from `t`, of the solution of y′ = f(t, y).

    `field(t, *y)` returns the derivatives and, after them, further functions of time and state
    whose series are wanted too. All series go up to the power `order`.

    Raises `NotAnalytic` if an operation has no recurrence.
    """
    closed = jax.make_jaxpr(field)(t, *y)
    clock = [t, unit] + [jnp.zeros_like(unit)] * (order - 1)
    states = [[value] for value in y]
    program: Program = []
    outputs = read(
        closed.jaxpr, closed.consts, [clock, *states], functools.partial(_apply, program)
    )
    rates, further = outputs[: len(y)], outputs[len(y) :]
    for k in range(order + 1):
        for extend in program:
            extend(k)
        if k < order:
            for state, rate in zip(states, rates, strict=True):
                state.append(_at(rate, k, t) * (unit / (k + 1)))
    return states, [[_at(output, k, t) for k in range(order + 1)] for output in further]


def _at(operand: Operand, k: int, like: Scalar) -> Array:
    """The coefficient of order k of a series or a constant."""
    if isinstance(operand, list):
        return operand[k]
    value = jnp.asarray(operand, like.dtype)
    return value if k == 0 else jnp.zeros_like(value)


def _all_at(operands: list[Operand], k: int) -> list[Array]:
    """The coefficients of order k of several operands, at least one of which is a series."""
    like = next(operand[0] for operand in operands if isinstance(operand, list))
    return [_at(operand, k, like) for operand in operands]


def _apply(program: Program, equation: JaxprEqn, operands: list[Operand]) -> Sequence[Operand]:
    """The outputs of an equation; functions that extend their series are added to `program`."""
    primitive, params = equation.primitive, equation.params
    if not any(isinstance(operand, list) for operand in operands):
        return unchanged(equation, operands)
    if primitive.name in _LINEAR or _widens(equation):
        (series,) = operands
        assert isinstance(series, list)
        return [_grown(program, lambda k: primitive.bind(series[k], **params))]
    if primitive.name in ("concatenate", "stack"):
        return [_grown(program, lambda k: primitive.bind(*_all_at(operands, k), **params))]
    if primitive.name not in _RULES:
        raise NotAnalytic(
            f"Operation `{primitive.name}` in the equations of motion has no Taylor recurrence; "
            "simulate with a Runge-Kutta step instead, `step=RungeKutta()`."
        )
    return [_RULES[primitive.name](operands, params, program)]


def _widens(equation: JaxprEqn) -> bool:
    """True if an equation only converts to a floating-point type of at least the same precision."""
    if equation.primitive.name != "convert_element_type":
        return False
    operand = equation.invars[0].aval
    assert isinstance(operand, ShapedArray)
    before, after = operand.dtype, equation.params["new_dtype"]
    both = jnp.issubdtype(before, jnp.floating) and jnp.issubdtype(after, jnp.floating)
    return bool(both and jnp.finfo(after).eps <= jnp.finfo(before).eps)


def _grown(program: Program, rule: Callable[[int], Array]) -> Series:
    """A series whose coefficient of order k is `rule(k)`."""
    series: Series = []
    program.append(lambda k: series.append(rule(k)))
    return series


# `lax` instead of operators: it traces faster, without promotion and broadcasting.


def _product_coefficient(a: Series, b: Series, k: int) -> Array:
    return functools.reduce(lax.add, [lax.mul(a[j], b[k - j]) for j in range(k + 1)])


def _square_coefficient(a: Series, k: int) -> Array:
    pairs = [_times(2, lax.mul(a[j], a[k - j])) for j in range((k + 1) // 2)]
    middle = [lax.mul(a[k // 2], a[k // 2])] if k % 2 == 0 else []
    return functools.reduce(lax.add, pairs + middle)


def _times(number: float, value: Array) -> Array:
    return lax.mul(value, np.full(value.shape, number, value.dtype))


def _add(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    del params
    a, b = operands
    if isinstance(a, list) and isinstance(b, list):
        return _grown(program, lambda k: lax.add(a[k], b[k]))
    series, constant = (a, b) if isinstance(a, list) else (b, a)
    assert isinstance(series, list)
    assert not isinstance(constant, list)
    return _grown(program, lambda k: lax.add(series[k], constant) if k == 0 else series[k])


def _subtract(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    a, b = operands
    if isinstance(b, list):
        return _add([a, _grown(program, lambda k: lax.neg(b[k]))], params, program)
    return _add([a, -b], params, program)


def _multiply(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    del params
    a, b = operands
    if isinstance(a, list) and isinstance(b, list):
        if a is b:
            return _grown(program, lambda k: _square_coefficient(a, k))
        return _grown(program, lambda k: _product_coefficient(a, b, k))
    series, constant = (a, b) if isinstance(a, list) else (b, a)
    assert isinstance(series, list)
    assert not isinstance(constant, list)
    return _grown(program, lambda k: lax.mul(series[k], constant))


def _divide(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    del params
    a, b = operands
    if not isinstance(b, list):
        assert isinstance(a, list)
        return _grown(program, lambda k: lax.div(a[k], b))
    quotient: Series = []

    def extend(k: int) -> None:
        rest = _at(a, k, b[0])
        for j in range(1, k + 1):
            rest = lax.sub(rest, lax.mul(b[j], quotient[k - j]))
        quotient.append(lax.div(rest, b[0]))

    program.append(extend)
    return quotient


def _integer_power(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    (a,) = operands
    assert isinstance(a, list)
    exponent = params["y"]
    if exponent == 0:
        return _grown(program, lambda k: jnp.full_like(a[0], 1.0 if k == 0 else 0.0))
    if exponent < 0:
        positive = _integer_power([a], {"y": -exponent}, program)
        return _divide([1.0, positive], {}, program)
    if exponent == 1:
        return a
    half = _integer_power([a], {"y": exponent // 2}, program)
    squared = _multiply([half, half], {}, program)
    return squared if exponent % 2 == 0 else _multiply([squared, a], {}, program)


def _square(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    return _multiply([operands[0], operands[0]], params, program)


def _derivative(operand: Operand, program: Program) -> Series:
    """J aⱼ at position j − 1; short of the last coefficient by one while the series grow."""
    assert isinstance(operand, list)
    slope: Series = []

    def extend(k: int) -> None:
        if k > 0:
            slope.append(_times(k, operand[k]))

    program.append(extend)
    return slope


def _exponential(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    del params
    (a,) = operands
    assert isinstance(a, list)
    slope = _derivative(a, program)
    power: Series = []

    def rule(k: int) -> Array:
        return lax.exp(a[0]) if k == 0 else _times(1 / k, _product_coefficient(slope, power, k - 1))

    program.append(lambda k: power.append(rule(k)))
    return power


def _sine_and_cosine(operand: Operand, program: Program) -> tuple[Series, Series]:
    assert isinstance(operand, list)
    slope = _derivative(operand, program)
    sine: Series = []
    cosine: Series = []

    def extend(k: int) -> None:
        if k == 0:
            sine.append(lax.sin(operand[0]))
            cosine.append(lax.cos(operand[0]))
        else:
            next_sine = _times(1 / k, _product_coefficient(slope, cosine, k - 1))
            next_cosine = _times(-1 / k, _product_coefficient(slope, sine, k - 1))
            sine.append(next_sine)
            cosine.append(next_cosine)

    program.append(extend)
    return sine, cosine


def _sine(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    del params
    return _sine_and_cosine(operands[0], program)[0]


def _cosine(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    del params
    return _sine_and_cosine(operands[0], program)[1]


def _select(operands: list[Operand], params: dict[str, PyTree], program: Program) -> Series:
    del params
    which, *cases = operands
    if isinstance(which, list):
        raise NotAnalytic(
            "The equations of motion switch with the state; simulate with a Runge-Kutta step "
            "instead, `step=RungeKutta()`, or make the switch an event."
        )

    return _grown(program, lambda k: lax.select_n(which, *_all_at(cases, k)))


_LINEAR = (
    "neg",
    "broadcast_in_dim",
    "reshape",
    "squeeze",
    "copy",
    "slice",
    "transpose",
    "rev",
    "reduce_sum",
)
_RULES: dict[str, Callable[[list[Operand], dict[str, PyTree], Program], Series]] = {
    "add": _add,
    "add_any": _add,
    "sub": _subtract,
    "mul": _multiply,
    "div": _divide,
    "integer_pow": _integer_power,
    "square": _square,
    "exp": _exponential,
    "sin": _sine,
    "cos": _cosine,
    "select_n": _select,
}
