"""Recurrences between switching points.

The value at the point of expansion decides the branch, which is then kept for the whole series; a
step must end where the branch changes.
"""

from collections.abc import Sequence

import jax.numpy as jnp
from jax import lax
from jax.core import ShapedArray
from jax.extend.core import JaxprEqn
from jaxtyping import Array

from impactjax._series.recurrences.arrays import convert
from impactjax._series.recurrences.series import (
    Operand,
    Program,
    Rule,
    Series,
    all_at,
    elementwise,
    grown,
    less,
    several_grown,
    start,
)


def _magnitude(program: Program, a: Series) -> Series:
    """The series of |a|, of a where a is zero."""
    return grown(program, lambda k: jnp.where(less(a[0], 0), lax.neg(a[k]), a[k]))


def _larger(program: Program, a: Operand, b: Operand) -> Series:
    """The series of the larger of two, of the first where they are equal."""

    def rule(k: int) -> Array:
        first, second = all_at([a, b], 0)
        return jnp.where(first >= second, *all_at([a, b], k))

    return grown(program, rule)


def _smaller(program: Program, a: Operand, b: Operand) -> Series:
    """The series of the smaller of two, of the first where they are equal."""

    def rule(k: int) -> Array:
        first, second = all_at([a, b], 0)
        return jnp.where(first <= second, *all_at([a, b], k))

    return grown(program, rule)


def _chosen(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    """The series of the case that is chosen at the start."""
    which, *cases = operands
    bind = equation.primitive.bind
    if any(isinstance(case, list) for case in cases):
        return [grown(program, lambda k: bind(start(which), *all_at(cases, k)))]
    return _held(equation, operands, program)


def _held(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    """A value that stays as it is at the start."""
    primitive, params = equation.primitive, equation.params

    def rule(k: int) -> Sequence[Array]:
        values = primitive.bind(*[start(operand) for operand in operands], **params)
        several = values if primitive.multiple_results else [values]
        return several if k == 0 else [jnp.zeros_like(value) for value in several]

    return several_grown(program, len(equation.outvars), rule)


def _converted(equation: JaxprEqn, operands: list[Operand], program: Program) -> Sequence[Operand]:
    """A value in another type; one without fractions is held."""
    after, before = equation.params["new_dtype"], equation.invars[0].aval
    assert isinstance(before, ShapedArray)
    both = jnp.issubdtype(before.dtype, jnp.floating) and jnp.issubdtype(after, jnp.floating)
    return (convert if both else _held)(equation, operands, program)


_STEPPED = ("sign", "floor", "ceil", "round", "lt", "le", "gt", "ge", "eq", "ne")
_LOGICAL = ("and", "or", "xor", "not", "is_finite", "reduce_and", "reduce_or")
_PLACES = ("argmax", "argmin", "lu_pivots_to_permutation", "rem")

SWITCHING: dict[str, Rule] = {
    "abs": elementwise(_magnitude),
    "max": elementwise(_larger),
    "min": elementwise(_smaller),
    "select_n": _chosen,
    "convert_element_type": _converted,
    **dict.fromkeys((*_STEPPED, *_LOGICAL, *_PLACES), _held),
}
