"""Recurrences of sums, products and quotients."""

import functools

import jax.numpy as jnp
from jax import lax
from jax.extend.core import JaxprEqn
from jaxtyping import Array

from impactjax._series.recurrences.series import (
    Operand,
    Program,
    Rule,
    Series,
    at,
    elementwise,
    grown,
    product_coefficient,
    times,
)


def add(program: Program, a: Operand, b: Operand) -> Series:
    """The series of a + b."""
    if isinstance(a, list) and isinstance(b, list):
        return grown(program, lambda k: lax.add(a[k], b[k]))
    series, constant = _sorted(a, b)
    return grown(program, lambda k: lax.add(series[k], constant) if k == 0 else series[k])


def subtract(program: Program, a: Operand, b: Operand) -> Series:
    """The series of a − b."""
    if isinstance(b, list):
        return add(program, a, grown(program, lambda k: lax.neg(b[k])))
    return add(program, a, -b)


def multiply(program: Program, a: Operand, b: Operand) -> Series:
    """The series of a b."""
    if isinstance(a, list) and isinstance(b, list):
        if a is b:
            return square(program, a)
        return grown(program, lambda k: product_coefficient(a, b, k))
    series, constant = _sorted(a, b)
    return grown(program, lambda k: lax.mul(series[k], constant))


def square(program: Program, a: Operand) -> Series:
    """The series of a²."""
    assert isinstance(a, list)
    return grown(program, lambda k: _square_coefficient(a, k))


def divide(program: Program, a: Operand, b: Operand) -> Series:
    """The series of q = a/b, from q b = a."""
    if not isinstance(b, list):
        assert isinstance(a, list)
        return grown(program, lambda k: lax.div(a[k], b))
    quotient: Series = []

    def extend(k: int) -> None:
        rest = at(a, k, b[0])
        for j in range(1, k + 1):
            rest = lax.sub(rest, lax.mul(b[j], quotient[k - j]))
        quotient.append(lax.div(rest, b[0]))

    program.append(extend)
    return quotient


def integer_power(program: Program, a: Operand, exponent: int) -> Series:
    """The series of aⁿ, by repeated squaring."""
    assert isinstance(a, list)
    if exponent == 0:
        return grown(program, lambda k: jnp.full_like(a[0], 1.0 if k == 0 else 0.0))
    if exponent < 0:
        return divide(program, 1.0, integer_power(program, a, -exponent))
    if exponent == 1:
        return a
    half = integer_power(program, a, exponent // 2)
    squared = multiply(program, half, half)
    return squared if exponent % 2 == 0 else multiply(program, squared, a)


def _sorted(a: Operand, b: Operand) -> tuple[Series, Array | float]:
    """The series and the constant among two operands."""
    series, constant = (a, b) if isinstance(a, list) else (b, a)
    assert isinstance(series, list)
    assert not isinstance(constant, list)
    return series, constant


def _square_coefficient(a: Series, k: int) -> Array:
    pairs = [times(2, lax.mul(a[j], a[k - j])) for j in range((k + 1) // 2)]
    middle = [lax.mul(a[k // 2], a[k // 2])] if k % 2 == 0 else []
    return functools.reduce(lax.add, pairs + middle)


def _integer_power(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    return [integer_power(program, operands[0], equation.params["y"])]


def _dot(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    """Cauchy's product of arrays."""
    a, b = operands
    bind = functools.partial(equation.primitive.bind, **equation.params)
    if isinstance(a, list) and isinstance(b, list):
        return [
            grown(
                program,
                lambda k: functools.reduce(lax.add, [bind(a[j], b[k - j]) for j in range(k + 1)]),
            )
        ]
    if isinstance(a, list):
        return [grown(program, lambda k: bind(a[k], b))]
    assert isinstance(b, list)
    return [grown(program, lambda k: bind(a, b[k]))]


ARITHMETIC: dict[str, Rule] = {
    "add": elementwise(add),
    "add_any": elementwise(add),
    "sub": elementwise(subtract),
    "mul": elementwise(multiply),
    "div": elementwise(divide),
    "square": elementwise(square),
    "integer_pow": _integer_power,
    "dot_general": _dot,
}
