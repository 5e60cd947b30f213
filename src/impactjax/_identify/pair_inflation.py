"""Inflation of the joint region of two parameters by correlated residuals."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import linalg

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.refits import Refits

Square = Float[np.ndarray, "2 2"]


class PairInflation(NamedTuple):
    """Ratio i² of the rise of the sum of squares to that which the covariance C of the estimate
    stands for, by the direction d from the estimate: i² = (dᵀ P d)/(dᵀ C⁻¹ d), at least 1. P is
    the inverse of the covariance for independent residuals.

    - `centre`: the estimate in the coordinates of a search.
    - `plain`, `precision`: P and C⁻¹.
    - `least`: the ratio in any direction, if these are not known.

    Source: R. E. Chandler and S. Bate (2007), "Inference for clustered data using the independence
    loglikelihood", Biometrika 94, 167.
    """

    centre: Float[np.ndarray, " 2"]
    plain: Square
    precision: Square
    least: float

    @property
    def largest(self) -> float:
        """The largest ratio."""
        if not np.isfinite(self.precision).all():
            return self.least
        return max(float(linalg.eigh(self.plain, self.precision, eigvals_only=True)[-1]), 1.0)

    def at(self, u: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "..."]:
        """The ratio at some coordinates of the two parameters."""
        away = u - self.centre
        if not np.isfinite(self.precision).all():
            return np.full(away.shape[:-1], self.least)
        above = np.einsum("...i,ij,...j->...", away, self.plain, away)
        below = np.einsum("...i,ij,...j->...", away, self.precision, away)
        return np.where(below > 0, np.maximum(above / np.where(below > 0, below, 1.0), 1.0), 1.0)


def pair_inflation(estimate: Estimate[P], refits: Refits, pair: list[int]) -> PairInflation:
    """The inflation for two parameters of an estimate."""
    values = np.asarray(estimate.values)
    u = np.asarray(refits.problem.coordinates(values))
    others = np.ones((2, len(u)), bool)
    others[:, pair] = False
    around = refits.points(np.stack([u, u]), others)
    along = around.along(np.eye(len(u))[pair])
    plain = np.einsum("ai,ij,bj->ab", along, around.hessian[0], along) / refits.variance
    slopes = np.asarray(refits.problem.slopes(u))[pair]
    covariance = np.asarray(estimate.covariance)[np.ix_(pair, pair)] / np.outer(slopes, slopes)
    determined = np.isfinite(covariance).all() and np.linalg.det(covariance) > 0
    precision = np.linalg.inv(covariance) if determined else np.full((2, 2), np.nan)
    least = max(1.0, *np.asarray(estimate.inflation)[pair]) ** 2
    return PairInflation(u[pair], plain, precision, float(least))
