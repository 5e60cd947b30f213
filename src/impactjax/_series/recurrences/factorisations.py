"""Recurrences of the factors of a matrix."""

from collections.abc import Sequence

import jax.numpy as jnp
from jax import lax
from jax.core import ShapedArray
from jax.extend.core import JaxprEqn
from jaxtyping import Array

from impactjax._series.recurrences.linear_systems import product
from impactjax._series.recurrences.series import (
    OnDemand,
    Operand,
    Program,
    Rule,
    Series,
    refusal,
)


def _lu(equation: JaxprEqn, operands: list[Operand], program: Program) -> Sequence[Series]:
    """L and U of P A = L U, with the order of rows P of the start.

    With R the known part of P Aₖ, M = L₀⁻¹ R U₀⁻¹ splits into L₀⁻¹ Lₖ below the diagonal and
    Uₖ U₀⁻¹ above it. Solutions of linear systems need no more than the factors at the start.
    """
    (a,) = operands
    assert isinstance(a, list)
    aval = equation.invars[0].aval
    assert isinstance(aval, ShapedArray)
    rows, columns = aval.shape[-2:]
    if rows != columns:
        raise refusal("lu")

    def coefficient(k: int) -> Array:
        rest = jnp.take_along_axis(a[k], permutation[0][..., None], axis=-2)
        for j in range(1, k):
            rest = lax.sub(rest, product(jnp.tril(factors[j], -1), jnp.triu(factors[k - j])))
        mixed = lax.linalg.triangular_solve(
            factors[0], rest, left_side=True, lower=True, unit_diagonal=True
        )
        mixed = lax.linalg.triangular_solve(factors[0], mixed, left_side=False, lower=False)
        lower = jnp.tril(factors[0], -1) + jnp.eye(rows, dtype=mixed.dtype)
        below, above = jnp.tril(mixed, -1), jnp.triu(mixed)
        return product(lower, below) + product(above, jnp.triu(factors[0]))

    factors = OnDemand(coefficient)
    pivots: Series = OnDemand(lambda _: jnp.zeros_like(pivots[0]))
    permutation: Series = OnDemand(lambda _: jnp.zeros_like(permutation[0]))

    def begin(k: int) -> None:
        if k == 0:
            found = equation.primitive.bind(a[0], **equation.params)
            for series, value in zip((factors, pivots, permutation), found, strict=True):
                series.append(value)

    program.append(begin)
    return [factors, pivots, permutation]


def _cholesky(equation: JaxprEqn, operands: list[Operand], program: Program) -> list[Series]:
    """L of A = L L′, where only the lower triangle of A counts.

    With R the known part of Aₖ, L₀⁻¹ Lₖ is the lower triangle of L₀⁻¹ R L₀⁻ᵀ with half its
    diagonal.
    """
    (a,) = operands
    assert isinstance(a, list)
    factors: Series = []

    def extend(k: int) -> None:
        if k == 0:
            factors.append(jnp.tril(equation.primitive.bind(a[0], **equation.params)))
            return
        rest = jnp.tril(a[k]) + _transposed(jnp.tril(a[k], -1))
        for j in range(1, k):
            rest = lax.sub(rest, product(factors[j], _transposed(factors[k - j])))
        mixed = lax.linalg.triangular_solve(factors[0], rest, left_side=True, lower=True)
        mixed = lax.linalg.triangular_solve(
            factors[0], mixed, left_side=False, lower=True, transpose_a=True
        )
        half = (jnp.tril(mixed) + jnp.tril(mixed, -1)) / 2
        factors.append(product(factors[0], half))

    program.append(extend)
    return [factors]


def _transposed(matrix: Array) -> Array:
    return jnp.swapaxes(matrix, -1, -2)


FACTORISATIONS: dict[str, Rule] = {"lu": _lu, "cholesky": _cholesky}
