"""Recurrences of elementary functions that are analytic wherever they are finite.

Each solves the differential equation of its function. Source: Moore (1966), chapter 11.
"""

import math
from collections.abc import Callable

from jax import lax
from jaxtyping import Array

from impactjax._series.recurrences.arithmetic import add, divide, multiply, square, subtract
from impactjax._series.recurrences.series import (
    Operand,
    Program,
    Rule,
    Series,
    derivative,
    elementwise,
    product_coefficient,
    times,
)

Value = Callable[[Array], Array]
Slope = Callable[[Program, Series], Series]


def solution(
    program: Program, a: Series, value: Value, slope: Callable[[Series], Series]
) -> Series:
    """The series of y(a), where y′ = slope(y) a′."""
    rate = derivative(program, a)
    y: Series = []

    def extend(k: int) -> None:
        if k == 0:
            y.append(value(a[0]))
        else:
            y.append(times(1 / k, product_coefficient(rate, factor, k - 1)))

    program.append(extend)
    factor = slope(y)
    return y


def by_value(value: Value, slope: Slope) -> Rule:
    """The rule of a function whose derivative is a function of its own value."""
    return elementwise(lambda program, a: solution(program, a, value, lambda y: slope(program, y)))


def by_argument(value: Value, slope: Slope) -> Rule:
    """The rule of a function whose derivative is a function of its argument."""
    return elementwise(lambda program, a: solution(program, a, value, lambda _: slope(program, a)))


def exponential(program: Program, a: Series, value: Value = lax.exp) -> Series:
    """The series of exp a."""
    return solution(program, a, value, lambda y: y)


def reciprocal(program: Program, a: Series) -> Series:
    """The series of 1/a."""
    return divide(program, 1.0, a)


def logarithm(program: Program, a: Series) -> Series:
    """The series of ln a."""
    return solution(program, a, lax.log, lambda _: reciprocal(program, a))


def power(program: Program, a: Series, exponent: Array | float, value: Value) -> Series:
    """The series of y = aᵖ from a y′ = p a′ y, where aᵖ is not zero or infinite."""
    rate = derivative(program, a)
    y: Series = []

    def extend(k: int) -> None:
        if k == 0:
            y.append(value(a[0]))
            return
        p = lax.convert_element_type(exponent, y[0].dtype)
        rest = lax.mul(product_coefficient(rate, y, k - 1), p)
        for j in range(k - 1):
            rest = lax.sub(rest, lax.mul(own_rate[j], a[k - 1 - j]))
        y.append(times(1 / k, lax.div(rest, a[0])))

    program.append(extend)
    own_rate = derivative(program, y)
    return y


def inverse_root(program: Program, a: Series) -> Series:
    """The series of 1/√a."""
    return power(program, a, -0.5, lax.rsqrt)


def _pair(program: Program, a: Series, values: tuple[Value, Value], sign: int) -> list[Series]:
    """The series of s(a) and c(a), where s′ = c a′ and c′ = ± s a′."""
    rate = derivative(program, a)
    sine: Series = []
    cosine: Series = []

    def extend(k: int) -> None:
        if k == 0:
            sine.append(values[0](a[0]))
            cosine.append(values[1](a[0]))
        else:
            next_sine = times(1 / k, product_coefficient(rate, cosine, k - 1))
            next_cosine = times(sign / k, product_coefficient(rate, sine, k - 1))
            sine.append(next_sine)
            cosine.append(next_cosine)

    program.append(extend)
    return [sine, cosine]


def _circular(program: Program, a: Series) -> list[Series]:
    return _pair(program, a, (lax.sin, lax.cos), -1)


def _hyperbolic(program: Program, a: Series) -> list[Series]:
    return _pair(program, a, (lax.sinh, lax.cosh), 1)


def one_minus_square(program: Program, a: Operand) -> Series:
    """The series of 1 − a²."""
    return subtract(program, 1.0, square(program, a))


def one_plus_square(program: Program, a: Operand) -> Series:
    """The series of 1 + a²."""
    return add(program, 1.0, square(program, a))


def _gaussian(program: Program, a: Series, factor: float) -> Series:
    """The series of factor · exp(−a²)."""
    negative = multiply(program, square(program, a), -1.0)
    return multiply(program, exponential(program, negative), factor)


_AT_ZERO = 2 / math.sqrt(math.pi)  # the slope of erf

ELEMENTARY: dict[str, Rule] = {
    "exp": elementwise(exponential),
    "exp2": by_value(lax.exp2, lambda program, y: multiply(program, y, math.log(2))),
    "expm1": by_value(lax.expm1, lambda program, y: add(program, y, 1.0)),
    "log": elementwise(logarithm),
    "log1p": by_argument(lax.log1p, lambda program, a: reciprocal(program, add(program, a, 1.0))),
    "rsqrt": elementwise(inverse_root),
    "sin": elementwise(lambda program, a: _circular(program, a)[0]),
    "cos": elementwise(lambda program, a: _circular(program, a)[1]),
    "sinh": elementwise(lambda program, a: _hyperbolic(program, a)[0]),
    "cosh": elementwise(lambda program, a: _hyperbolic(program, a)[1]),
    "tan": by_value(lax.tan, one_plus_square),
    "tanh": by_value(lax.tanh, one_minus_square),
    "logistic": by_value(
        lax.logistic, lambda program, y: multiply(program, y, subtract(program, 1.0, y))
    ),
    "atan": by_argument(
        lax.atan, lambda program, a: reciprocal(program, one_plus_square(program, a))
    ),
    "atanh": by_argument(
        lax.atanh, lambda program, a: reciprocal(program, one_minus_square(program, a))
    ),
    "asinh": by_argument(
        lax.asinh, lambda program, a: inverse_root(program, one_plus_square(program, a))
    ),
    "erf": by_argument(lax.erf, lambda program, a: _gaussian(program, a, _AT_ZERO)),
    "erfc": by_argument(lax.erfc, lambda program, a: _gaussian(program, a, -_AT_ZERO)),
}
