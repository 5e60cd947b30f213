"""Taylor series of an ODE's solution, from the vector field itself.

The field's jaxpr is read once; each primitive has a recurrence that gives the next coefficient of
its output from the coefficients of its inputs, and the field gives the next coefficients of the
state. Source: Moore (1966); Jorba & Zou, Experimental Mathematics 14, 99 (2005).
"""

import functools
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
from jax import lax
from jax.extend.core import JaxprEqn
from jaxtyping import Array

from impactjax._series.jaxpr import read, unchanged
from impactjax._series.recurrences.series import (
    Operand,
    Program,
    Series,
    all_at,
    at,
    grown,
    refusal,
    start,
)
from impactjax._series.recurrences.tables import EVERYWHERE, Table
from impactjax._types import Scalar


def solution_series(
    field: Callable[..., Sequence[Array]],
    t: Scalar,
    y: Sequence[Array],
    order: int,
    unit: Scalar,
    table: Table = EVERYWHERE,
) -> tuple[list[Series], list[Series]]:
    """Taylor coefficients, in time counted in `unit`s from `t`, of the solution of y′ = f(t, y).

    `field(t, *y)` returns the derivatives and, after them, further functions of time and state
    whose series are wanted too. The values are arrays of any shape. All series go up to the power
    `order`.

    Raises `NotAnalytic` if an operation has no recurrence in the `table`.
    """
    closed = jax.make_jaxpr(field)(t, *y)
    clock = [t, unit] + [jnp.zeros_like(unit)] * (order - 1)
    states = [[value] for value in y]
    program: Program = []
    outputs = read(
        closed.jaxpr, closed.consts, [clock, *states], functools.partial(_apply, table, program)
    )
    rates, further = outputs[: len(y)], outputs[len(y) :]
    for k in range(order + 1):
        for extend in program:
            extend(k)
        if k < order:
            for state, rate in zip(states, rates, strict=True):
                state.append(at(rate, k, t) * (unit / (k + 1)))
    return states, [[at(output, k, t) for k in range(order + 1)] for output in further]


def _apply(
    table: Table, program: Program, equation: JaxprEqn, operands: list[Operand]
) -> Sequence[Operand]:
    """The outputs of an equation; functions that extend their series are added to `program`."""
    if not any(isinstance(operand, list) for operand in operands):
        return unchanged(equation, operands)
    name = equation.primitive.name
    if name == "cond" and not isinstance(operands[0], list):
        index, *arguments = operands
        rule = functools.partial(_apply, table, program)
        branches = equation.params["branches"]
        outputs = [read(branch.jaxpr, branch.consts, arguments, rule) for branch in branches]
        return [_selected(program, start(index), cases) for cases in zip(*outputs, strict=True)]
    if name not in table:
        raise refusal(name)
    return table[name](equation, operands, program)


def _selected(program: Program, index: Array | float, cases: Sequence[Operand]) -> Operand:
    """The case of an index that time does not change."""
    which = jnp.clip(jnp.asarray(index, jnp.int32), 0, len(cases) - 1)
    if any(isinstance(case, list) for case in cases):
        return grown(program, lambda k: lax.select_n(which, *all_at(cases, k)))
    return lax.select_n(which, *map(jnp.asarray, cases))
