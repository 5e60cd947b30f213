"""Bounds of a function over a box: interval arithmetic on its jaxpr.

Each primitive maps intervals of its operands to an interval that contains all its values; a
primitive without a rule gives (−∞, ∞). Source: Moore, Interval Analysis (1966). Rounding is not
directed outwards: a bound is as exact as the function itself.
"""

import math
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jax.extend.core import JaxprEqn
from jaxtyping import Array, PyTree

from impactjax._series.jaxpr import read, unchanged
from impactjax._types import Scalar


class Interval(NamedTuple):
    """All values from `low` to `high`; `False` to `True` for an undecided condition."""

    low: Array
    high: Array

    def width(self) -> Array:
        """Width high − low."""
        return self.high - self.low


Operand: TypeAlias = Interval | Array  # an interval, or a value that does not vary over the box
Map: TypeAlias = Callable[..., Array]


def bounds(function: Callable[..., Scalar], *box: Interval) -> Interval:
    """An interval that contains all values of a function of scalars over a box."""
    closed = jax.make_jaxpr(function)(*[side.low for side in box])
    (found,) = read(closed.jaxpr, closed.consts, box, _rule)
    return _widened(found)


def _rule(equation: JaxprEqn, operands: list[Operand]) -> Sequence[Operand]:
    if not any(isinstance(operand, Interval) for operand in operands):
        return unchanged(equation, operands)
    name = equation.primitive.name
    if name not in _RULES:
        return [_anything(variable.aval) for variable in equation.outvars]

    def same(*values: Array) -> Array:
        return equation.primitive.bind(*values, **equation.params)

    return [_RULES[name](same, equation.params, operands)]


def _widened(operand: Operand) -> Interval:
    return operand if isinstance(operand, Interval) else Interval(operand, operand)


def _anything(aval: Any) -> Interval:  # noqa: ANN401  JAX names no type for it
    dtype = aval.dtype
    if jnp.issubdtype(dtype, jnp.bool_):
        least, most = False, True
    elif jnp.issubdtype(dtype, jnp.floating):
        least, most = -jnp.inf, jnp.inf
    else:
        least, most = jnp.iinfo(dtype).min, jnp.iinfo(dtype).max
    return Interval(jnp.full(aval.shape, least, dtype), jnp.full(aval.shape, most, dtype))


def _hull(values: list[Array]) -> Interval:
    return Interval(reduce(jnp.minimum, values), reduce(jnp.maximum, values))


def _of_corners(same: Map, operands: list[Operand]) -> Interval:
    """Bounds of a map that is monotone in each operand: the extremes are at the corners."""
    corners = [()]
    for operand in operands:
        ends = tuple(operand) if isinstance(operand, Interval) else (operand,)
        corners = [(*corner, end) for corner in corners for end in ends]
    return _hull([same(*corner) for corner in corners])


def _rising(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    """Bounds of a map that increases in all its operands, or rearranges them."""
    del params
    each = [_widened(operand) for operand in operands]
    return Interval(same(*[side.low for side in each]), same(*[side.high for side in each]))


def _held(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Array:
    """A number that a step holds as it is at the begin of the interval of time."""
    del params
    return same(_widened(operands[0]).low)


def _converted(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    low, high = _rising(same, params, operands)
    return Interval(low, high) if low.dtype != bool else _anything(low)


def _falling(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    low, high = _rising(same, params, operands)
    return Interval(high, low)


def _above(least: float, otherwise: Callable[..., PyTree]) -> Callable[..., PyTree]:
    """A rule that is valid for operands above `least`; otherwise the value is unbounded."""

    def rule(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
        low, high = otherwise(same, params, operands)
        fine = _widened(operands[0]).low > least
        return Interval(jnp.where(fine, low, -jnp.inf), jnp.where(fine, high, jnp.inf))

    return rule


def _subtract(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    del params
    a, b = (_widened(operand) for operand in operands)
    return Interval(same(a.low, b.high), same(a.high, b.low))


def _multiply(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    if operands[0] is operands[1]:
        return _even(same, params, operands)
    return _of_corners(same, operands)


def _even(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    """Bounds of a map that rises with the distance of its operand from zero."""
    del params
    low, high = _widened(operands[0])
    far = jnp.maximum(jnp.abs(low), jnp.abs(high))
    near = jnp.where((low <= 0) & (high >= 0), 0, jnp.minimum(jnp.abs(low), jnp.abs(high)))
    count = len(operands)
    return Interval(same(*[near] * count), same(*[far] * count))


def _divide(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    del params
    low, high = _of_corners(same, operands)
    divisor = _widened(operands[1])
    fine = (divisor.low > 0) | (divisor.high < 0)
    return Interval(jnp.where(fine, low, -jnp.inf), jnp.where(fine, high, jnp.inf))


def _integer_power(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    exponent = params["y"]
    if exponent >= 0:
        return (_rising if exponent % 2 else _even)(same, params, operands)
    (base,) = operands
    low, high = _of_corners(same, operands)
    assert isinstance(base, Interval)
    fine = (base.low > 0) | (base.high < 0)
    return Interval(jnp.where(fine, low, -jnp.inf), jnp.where(fine, high, jnp.inf))


def _power(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    del params
    low, high = _of_corners(same, operands)
    fine = _widened(operands[0]).low >= 0
    return Interval(jnp.where(fine, low, -jnp.inf), jnp.where(fine, high, jnp.inf))


def _logical(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    low, high = _rising(same, params, operands)
    return Interval(low, high) if low.dtype == bool else _anything(low)


def _sine(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    del same, params
    return _wave(_widened(operands[0]), jnp.sin, math.pi / 2)


def _cosine(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    del same, params
    return _wave(_widened(operands[0]), jnp.cos, 0.0)


def _wave(angle: Interval, wave: Map, crest: float) -> Interval:
    """Bounds of a sine that has a maximum at `crest`."""

    def holds(place: float) -> Array:
        turn = jnp.ceil((angle.low - place) / (2 * math.pi))
        return place + 2 * math.pi * turn <= angle.high

    low, high = _hull([wave(angle.low), wave(angle.high)])
    return Interval(
        jnp.where(holds(crest - math.pi), -1.0, low), jnp.where(holds(crest), 1.0, high)
    )


def _less(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    """Truth of `a < b`: decided if it is the same for all pairs of ends."""
    del params
    a, b = (_widened(operand) for operand in operands)
    return Interval(same(a.high, b.low), same(a.low, b.high))


def _greater(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    del params
    a, b = (_widened(operand) for operand in operands)
    return Interval(same(a.low, b.high), same(a.high, b.low))


def _select(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    del params
    which, *cases = operands
    lows, highs = zip(*[_widened(case) for case in cases], strict=True)
    if not isinstance(which, Interval):
        return Interval(same(which, *lows), same(which, *highs))
    sure = which.low == which.high
    return Interval(
        jnp.where(sure, same(which.low, *lows), reduce(jnp.minimum, lows)),
        jnp.where(sure, same(which.low, *highs), reduce(jnp.maximum, highs)),
    )


def _contract(same: Map, params: dict[str, PyTree], operands: list[Operand]) -> Interval:
    """Bounds of a product of arrays, from the middle and the radius of each."""
    del params
    sides = [_widened(operand) for operand in operands]
    middle, other = (side.low + side.width() / 2 for side in sides)
    radius, other_radius = (side.width() / 2 for side in sides)
    value = same(middle, other)
    spread = same(jnp.abs(middle), other_radius) + same(radius, jnp.abs(other) + other_radius)
    return Interval(value - spread, value + spread)


_RISING = (
    "add", "add_any", "max", "min", "exp", "exp2", "expm1", "tanh", "sinh", "asinh", "atan", "erf",
    "logistic", "cbrt", "sqrt", "asin", "sign", "floor", "ceil", "round", "clamp",
    "reduce_sum", "reduce_max", "reduce_min", "cumsum", "cummax", "cummin", "broadcast_in_dim",
    "reshape", "squeeze", "expand_dims", "copy", "slice", "transpose", "rev", "concatenate",
    "stack", "stop_gradient", "reduce_and", "reduce_or",
)  # fmt: skip
_RULES: dict[str, Callable[[Map, dict[str, PyTree], list[Operand]], Operand]] = {
    **dict.fromkeys(_RISING, _rising),
    **dict.fromkeys(("neg", "not", "acos"), _falling),
    **dict.fromkeys(("abs", "square", "cosh"), _even),
    **dict.fromkeys(("lt", "le"), _less),
    **dict.fromkeys(("gt", "ge"), _greater),
    **dict.fromkeys(("and", "or"), _logical),
    "convert_element_type": _converted,
    "log": _above(0.0, _rising),
    "log1p": _above(-1.0, _rising),
    "rsqrt": _above(0.0, _falling),
    "held": _held,
    "sub": _subtract,
    "mul": _multiply,
    "div": _divide,
    "integer_pow": _integer_power,
    "pow": _power,
    "sin": _sine,
    "cos": _cosine,
    "select_n": _select,
    "dot_general": _contract,
}
