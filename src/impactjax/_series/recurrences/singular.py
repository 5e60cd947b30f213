"""Recurrences of functions that are finite, but not analytic, at a singular point.

There the series is not finite, so that a step cannot pass it unnoticed.
"""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from impactjax._series.recurrences.arithmetic import (
    add,
    divide,
    multiply,
    square,
    subtract,
)
from impactjax._series.recurrences.elementary import (
    by_argument,
    exponential,
    inverse_root,
    logarithm,
    one_minus_square,
    power,
)
from impactjax._series.recurrences.series import (
    Operand,
    Program,
    Rule,
    Series,
    all_at,
    derivative,
    elementwise,
    grown,
    product_coefficient,
    times,
)


def root(program: Program, a: Series) -> Series:
    """The series of s = √a, from s² = a."""
    s: Series = []

    def extend(k: int) -> None:
        if k == 0:
            s.append(lax.sqrt(a[0]))
            return
        rest = a[k]
        for j in range(1, (k + 1) // 2):
            rest = lax.sub(rest, times(2, lax.mul(s[j], s[k - j])))
        if k % 2 == 0:
            rest = lax.sub(rest, lax.mul(s[k // 2], s[k // 2]))
        s.append(lax.div(rest, times(2, s[0])))

    program.append(extend)
    return s


def _power(program: Program, a: Operand, exponent: Operand) -> Series:
    """The series of aᵇ: exp(b ln a) where the exponent varies."""
    if not isinstance(exponent, list):
        assert isinstance(a, list)
        return power(program, a, exponent, lambda value: lax.pow(value, jnp.asarray(exponent)))
    log = logarithm(program, a) if isinstance(a, list) else jnp.log(a)
    product = multiply(program, exponent, log)
    return exponential(program, product, lambda _: lax.pow(*all_at([a, exponent], 0)))


def _arc(program: Program, a: Series) -> Series:
    """The series of 1/√(1 − a²)."""
    return inverse_root(program, one_minus_square(program, a))


def _area(program: Program, a: Series) -> Series:
    """The series of 1/√(a² − 1)."""
    return inverse_root(program, subtract(program, square(program, a), 1.0))


def _angle(program: Program, y: Operand, x: Operand) -> Series:
    """The series of the angle θ of the point (x, y), from r² θ′ = x y′ − y x′."""
    ordinate, abscissa = _as_series(program, y, like=x), _as_series(program, x, like=y)
    squared = add(program, square(program, ordinate), square(program, abscissa))
    by_y = divide(program, abscissa, squared)
    by_x = divide(program, multiply(program, ordinate, -1.0), squared)
    y_rate, x_rate = derivative(program, ordinate), derivative(program, abscissa)

    def rule(k: int) -> Array:
        if k == 0:
            return jnp.arctan2(ordinate[0], abscissa[0])
        along_y = product_coefficient(by_y, y_rate, k - 1)
        return times(1 / k, lax.add(along_y, product_coefficient(by_x, x_rate, k - 1)))

    return grown(program, rule)


def _as_series(program: Program, operand: Operand, like: Operand) -> Series:
    """An operand, as a series also where it is constant."""
    if isinstance(operand, list):
        return operand
    return grown(program, lambda k: all_at([operand, like], k)[0])


SINGULAR: dict[str, Rule] = {
    "sqrt": elementwise(root),
    "cbrt": elementwise(lambda program, a: power(program, a, 1 / 3, lax.cbrt)),
    "pow": elementwise(_power),
    "asin": by_argument(lax.asin, _arc),
    "acos": by_argument(lax.acos, lambda program, a: multiply(program, _arc(program, a), -1.0)),
    "acosh": by_argument(lax.acosh, _area),
    "atan2": elementwise(_angle),
}
