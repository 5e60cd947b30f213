"""Recurrences of linear systems.

A(t) x(t) = b(t) gives A₀ xₖ = bₖ − Σ Aⱼ xₖ₋ⱼ over j = 1 ... k, with one factorisation of A₀.
"""

import functools
import math

import jax.numpy as jnp
from jax import lax
from jax.extend.core import ClosedJaxpr, JaxprEqn
from jaxtyping import Array

from impactjax._series.jaxpr import read, unchanged
from impactjax._series.recurrences.arrays import REARRANGING
from impactjax._series.recurrences.series import (
    NotAnalytic,
    Operand,
    Program,
    Rule,
    Series,
    all_at,
    start,
)

product = functools.partial(jnp.matmul, precision=lax.Precision.HIGHEST)  # as in a solution


def _solve(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    """The solution of a system given by the product of its matrix with a vector."""
    primitive, params = equation.primitive, equation.params
    lengths, matvec = params["const_lengths"], params["jaxprs"].matvec
    constants, right = operands[: sum(lengths)], operands[sum(lengths) :]
    matrix = constants[: lengths.matvec]
    varies = any(isinstance(each, list) for each in matrix)
    if varies and not _is_product(matvec):
        raise NotAnalytic(
            "The equations of motion hold a linear system (`custom_linear_solve`) whose operator "
            "is not a product with a matrix and has no Taylor recurrence; simulate with a "
            "Runge-Kutta step instead, `step=RungeKutta()`."
        )
    solution: list[Series] = [[] for _ in right]

    def extend(k: int) -> None:
        rest = all_at([*right, *matrix], k)[: len(right)]
        for j in range(1, k + 1) if varies else ():
            coefficients = all_at([*matrix, *right], j)[: len(matrix)]
            known = [series[k - j] for series in solution]
            moved = read(matvec.jaxpr, matvec.consts, [*coefficients, *known], unchanged)
            rest = [lax.sub(each, other) for each, other in zip(rest, moved, strict=True)]
        found = primitive.bind(*map(start, constants), *rest, **params)
        for series, coefficient in zip(solution, found, strict=True):
            series.append(coefficient)

    program.append(extend)
    return solution


def _is_product(matvec: ClosedJaxpr) -> bool:
    """True if a function linear in its last argument is linear also in the others together."""
    inputs = [1] * len(matvec.jaxpr.invars)
    return all(degree == 2 for degree in read(matvec.jaxpr, matvec.consts, inputs, _degrees))


def _degrees(equation: JaxprEqn, operands: list[float | Array]) -> list[float]:
    """Degrees of an operation's outputs as polynomials in the inputs; NaN if not known."""
    degrees = [each if isinstance(each, int | float) else 0 for each in operands]
    name = equation.primitive.name
    if name in ("mul", "dot_general"):
        return [sum(degrees)]
    same = name in ("add", "add_any", "sub", *REARRANGING) and min(degrees) == max(degrees)
    return [degrees[0] if same else math.nan] * len(equation.outvars)


def _triangular_solve(
    equation: JaxprEqn, operands: list[Operand], program: Program
) -> list[Series]:
    """The solution X of T X = B or X T = B with a triangular T or its transpose."""
    primitive, params = equation.primitive, equation.params
    matrix, right = operands
    solution: Series = []

    def moved(j: int, known: Array) -> Array:
        other = _triangle(all_at([matrix, right], j)[0], params)
        return product(other, known) if params["left_side"] else product(known, other)

    def extend(k: int) -> None:
        rest = all_at([right, matrix], k)[0]
        for j in range(1, k + 1) if isinstance(matrix, list) else ():
            rest = lax.sub(rest, moved(j, solution[k - j]))
        solution.append(primitive.bind(start(matrix), rest, **params))

    program.append(extend)
    return [solution]


def _triangle(coefficient: Array, params: dict[str, bool]) -> Array:
    """The part that counts of a coefficient after the first, whose unit diagonal is zero."""
    outside = 1 if params["unit_diagonal"] else 0
    lower = params["lower"]
    part = jnp.tril(coefficient, -outside) if lower else jnp.triu(coefficient, outside)
    return jnp.swapaxes(part, -1, -2) if params["transpose_a"] else part


LINEAR_SYSTEMS: dict[str, Rule] = {
    "custom_linear_solve": _solve,
    "triangular_solve": _triangular_solve,
}
