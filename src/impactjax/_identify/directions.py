"""Combinations of parameters, from the best determined to the worst."""

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, Int

from impactjax._known import AnyArray, namespace

DETERMINED = 0.5  # relative standard error at which a 95 % interval reaches zero
_SAME = 0.99  # ratio to the largest exponent above which one counts as equally large
_ABSENT = 1e-6  # relative size of a component that counts as rounding

Sensitivities = Float[AnyArray, "data parameters"]
Weights = Float[Array | np.ndarray, "... parameters"]


class Spread(eqx.Module):
    """Standard errors of sums Σ wᵢ uᵢ of scaled parameters: |diag(errors) axes w|.

    They come from the singular value decomposition of the sensitivities, with columns scaled to
    length one. The result then does not depend on units, and rounding does not grow with the ratio
    of the parameters' sizes.

    - `axes`: right singular vectors divided by the columns' lengths.
    - `errors`: inverse singular values; infinite if the data do not determine the axis.
    """

    axes: Float[AnyArray, "axes parameters"]
    errors: Float[AnyArray, " axes"]

    def error(self, weights: Weights) -> Float[AnyArray, "..."]:
        """Standard error of each sum; infinite if it contains an undetermined axis, NaN if the
        sensitivities are not finite.
        """
        xp = namespace(self.errors, weights)
        along = weights @ self.axes.T
        told = xp.isfinite(self.errors)
        missing = ~told & (xp.abs(along) > _ABSENT * xp.linalg.norm(along, axis=-1, keepdims=True))
        size = xp.linalg.norm(
            xp.where(told, along * xp.where(told, self.errors, 0.0), 0.0), axis=-1
        )
        size = xp.where(missing.any(axis=-1), xp.inf, size)
        return xp.where(xp.isnan(along).any(axis=-1), xp.nan, size)

    def part(self, indices: Int[np.ndarray, " own"]) -> "Spread":
        """The errors of some parameters, with the others estimated from the same data."""
        return Spread(self.axes[:, indices], self.errors)


class Directions(eqx.Module):
    """The eigenvectors of the Fisher information, stiff ones first, sloppy ones last.

    A direction with exponents w is a product of powers Π pᵢ^wᵢ of the parameters, to first order a
    sum Σ wᵢ δpᵢ/scaleᵢ. Directions are orthogonal; their errors are uncorrelated.

    - `names`: names of the parameters.
    - `exponents`: w, one row of length one for each direction; its largest entry, or the last of
      equally large ones, is positive [1].
    - `errors`: relative standard error of each; infinite if the data do not determine it [1].
    - `spread`: errors of arbitrary sums, and so of single parameters.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    exponents: Float[AnyArray, "directions parameters"]
    errors: Float[AnyArray, " directions"]
    spread: Spread

    def error(self, exponents: Weights) -> Float[AnyArray, "..."]:
        """Relative standard error of any other product of powers [1]."""
        return self.spread.error(exponents)


def spread(sensitivities: Sensitivities) -> Spread:
    """Errors of sums of parameters, from sensitivities of the data divided by their noise."""
    xp = namespace(sensitivities)
    length = xp.linalg.norm(sensitivities, axis=0)
    length = xp.where(length > 0, length, 1.0)
    rows, sizes = principal_axes(sensitivities / length)
    told = sizes > _rounding(sensitivities) * xp.max(sizes, initial=0.0)
    errors = xp.where(told, 1 / xp.where(told, sizes, 1.0), xp.inf)
    return Spread(rows / length, errors)


def directions(names: tuple[str, ...], sensitivities: Sensitivities, spread: Spread) -> Directions:
    """Directions of the named parameters.

    **Arguments:**

    - `names`: names of the parameters.
    - `sensitivities`: with the part removed that other parameters explain, by `without`.
    - `spread`: errors of sums of the named parameters.
    """
    xp = namespace(sensitivities)
    rows, _ = principal_axes(sensitivities)
    absolute = xp.abs(rows)
    large = absolute > _SAME * xp.max(absolute, axis=1, keepdims=True, initial=0.0)
    last = large & (xp.cumsum(large[:, ::-1], axis=1)[:, ::-1] == 1)
    sign = xp.sign(xp.sum(xp.where(last, rows, 0.0), axis=1, keepdims=True))
    return Directions(names, rows * sign, spread.error(rows), spread)


def principal_axes(sensitivities: Sensitivities) -> tuple[AnyArray, AnyArray]:
    """Right singular vectors, one for each parameter, and their singular values."""
    xp = namespace(sensitivities)
    missing = max(sensitivities.shape[1] - sensitivities.shape[0], 0)
    full = xp.pad(sensitivities, ((0, missing), (0, 0)))
    _, sizes, rows = _svd(full)
    return rows, sizes


def without(sensitivities: Sensitivities, others: Float[AnyArray, "data others"]) -> Sensitivities:
    """Sensitivities projected orthogonally to those of other parameters, which are estimated from
    the same data: S − B Bᵀ S with an orthonormal basis B of the others.
    """
    xp = namespace(others)
    size = xp.linalg.norm(others, axis=0)
    unit = others / xp.where(size > 0, size, 1.0)
    vectors, sizes, _ = _svd(unit)
    basis = xp.where(sizes > _rounding(unit) * xp.max(sizes, initial=0.0), vectors, 0.0)
    return sensitivities - basis @ (basis.T @ sensitivities)


def _svd(matrix: Float[Any, "rows columns"]) -> tuple[Any, ...]:
    """Singular values and vectors; NaN, also in NumPy, if the matrix is not finite."""
    xp = namespace(matrix)
    if xp is np and not np.isfinite(matrix).all():
        return tuple(np.full_like(each, np.nan) for each in _svd(np.zeros_like(matrix)))
    return xp.linalg.svd(matrix, full_matrices=False)


def _rounding(matrix: Float[AnyArray, "rows columns"]) -> float:
    """Relative size of a singular value, compared with the largest, that counts as rounding."""
    return max(matrix.shape) * float(np.finfo(matrix.dtype).eps)
