"""Combinations of parameters, from the best determined to the worst."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._types import Scalar

_SAME = 0.99  # of the largest exponent: counts as large
_ABSENT = 1e-6  # a component this small is rounding

Sensitivities = Float[Array, "data parameters"]


class Directions(eqx.Module):
    """The eigenvectors of the Fisher information, stiff ones first, sloppy ones last.

    A direction with exponents w is a product of powers Π pᵢ^wᵢ of the parameters, to first order a
    sum Σ wᵢ δpᵢ/scaleᵢ. Directions are orthogonal; their errors are uncorrelated.

    - `names`: of the parameters.
    - `exponents`: w, of length one, a row a direction; the largest, or the last
      of equal ones, is positive [1].
    - `errors`: standard error of each, relative; infinite where the data tell nothing [1].
    """

    names: tuple[str, ...] = eqx.field(static=True)
    exponents: Float[Array, "directions parameters"]
    errors: Float[Array, " directions"]

    @eqx.filter_jit
    def error(self, exponents: Float[Array, " parameters"]) -> Scalar:
        """Standard error of any other product of powers, relative [1]."""
        along = self.exponents @ exponents
        felt = jnp.abs(along) > _ABSENT * jnp.linalg.norm(exponents)
        parts = jnp.where(felt, along, 0.0) * jnp.where(felt, self.errors, 0.0)
        return jnp.linalg.norm(parts)


def directions(names: tuple[str, ...], sensitivities: Sensitivities) -> Directions:
    """The directions of what data tell, from their sensitivities in sizes of their noise."""
    count = len(names)
    missing = max(count - sensitivities.shape[0], 0)
    full = jnp.pad(sensitivities, ((0, missing), (0, 0)))
    _, sizes, rows = jnp.linalg.svd(full, full_matrices=False)
    told = sizes > _rounding(full) * jnp.max(sizes, initial=0.0)
    errors = jnp.where(told, 1 / jnp.where(told, sizes, 1.0), jnp.inf)
    absolute = jnp.abs(rows)
    large = absolute > _SAME * jnp.max(absolute, axis=1, keepdims=True, initial=0.0)
    last = large & (jnp.cumsum(large[:, ::-1], axis=1)[:, ::-1] == 1)
    sign = jnp.sign(jnp.sum(jnp.where(last, rows, 0.0), axis=1, keepdims=True))
    return Directions(names, rows * sign, errors)


def without(sensitivities: Sensitivities, others: Float[Array, "data others"]) -> Sensitivities:
    """What is left of sensitivities when other parameters are found from the same data."""
    size = jnp.linalg.norm(others, axis=0)
    unit = others / jnp.where(size > 0, size, 1.0)
    vectors, sizes, _ = jnp.linalg.svd(unit, full_matrices=False)
    basis = jnp.where(sizes > _rounding(unit) * jnp.max(sizes, initial=0.0), vectors, 0.0)
    return sensitivities - basis @ (basis.T @ sensitivities)


def _rounding(matrix: Float[Array, "rows columns"]) -> float:
    """The size of a singular value, relative to the largest, that is nothing but rounding."""
    return max(matrix.shape) * float(jnp.finfo(matrix.dtype).eps)
