"""Recurrences of operations that rearrange or add the elements of arrays, all linear."""

from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
from jax.core import ShapedArray
from jax.extend.core import JaxprEqn
from jaxtyping import Array

from impactjax._series.recurrences.series import (
    NotAnalytic,
    Operand,
    Program,
    Rule,
    Series,
    all_at,
    grown,
    refusal,
    several_grown,
    start,
)


def _linear(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    """The outputs of an operation that is linear in all its operands together."""
    primitive, params = equation.primitive, equation.params
    if primitive.multiple_results:
        return several_grown(
            program,
            len(equation.outvars),
            lambda k: primitive.bind(*all_at(operands, k), **params),
        )
    return [grown(program, lambda k: primitive.bind(*all_at(operands, k), **params))]


def _by_indices(*places: int) -> Rule:
    """The rule of an operation linear in the operands at these places together.

    The others, indices or choices, are whole numbers and stay as they are at the start.
    """

    def rule(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
        primitive, params = equation.primitive, equation.params
        values = [operands[place] for place in places]

        def coefficient(k: int) -> Array:
            arguments = [start(operand) for operand in operands]
            for place, value in zip(places, all_at(values, k), strict=True):
                arguments[place] = value
            return primitive.bind(*arguments, **_filled(params, k))

        return [grown(program, coefficient)]

    return rule


def _filled(params: dict[str, Any], k: int) -> dict[str, Any]:
    """Parameters in which the number that fills a gap outside an array does not change."""
    filled = k > 0 and params.get("fill_value") is not None
    return params | {"fill_value": 0} if filled else params


def convert(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    """A value as a floating-point type of at least the same precision."""
    operand = equation.invars[0].aval
    assert isinstance(operand, ShapedArray)
    before, after = operand.dtype, equation.params["new_dtype"]
    both = jnp.issubdtype(before, jnp.floating) and jnp.issubdtype(after, jnp.floating)
    if not (both and jnp.finfo(after).eps <= jnp.finfo(before).eps):
        raise refusal(equation.primitive.name)
    return _linear(equation, operands, program)


def _select(equation: JaxprEqn, operands: list[Operand], program: Program) -> Sequence[Operand]:
    """One of several cases, by a choice that does not change with time."""
    if isinstance(operands[0], list):
        raise NotAnalytic(
            "The equations of motion switch with the state; simulate with a Runge-Kutta step "
            "instead, `step=RungeKutta()`, or make the switch an event."
        )
    return _by_indices(*range(1, len(operands)))(equation, operands, program)


def _start(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Operand]:
    """The value at the point of expansion, which time does not change."""
    del equation, program
    return [start(operand) for operand in operands]


REARRANGING = (
    "neg",
    "broadcast_in_dim",
    "reshape",
    "squeeze",
    "copy",
    "slice",
    "transpose",
    "rev",
    "reduce_sum",
    "cumsum",
    "split",
    "unstack",
    "tile",
    "stop_gradient",
    "concatenate",
    "stack",
    "pad",
)

ARRAYS: dict[str, Rule] = {
    **dict.fromkeys(REARRANGING, _linear),
    "convert_element_type": convert,
    "select_n": _select,
    "held": _start,
    "gather": _by_indices(0),
    "dynamic_slice": _by_indices(0),
    "dynamic_update_slice": _by_indices(0, 1),
    "scatter": _by_indices(0, 2),
    "scatter-add": _by_indices(0, 2),
    "scatter-sub": _by_indices(0, 2),
}
