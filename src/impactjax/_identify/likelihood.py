"""Likelihood of the residuals of a recording, for a posterior distribution.

The noise is normal. If its size σ is known, its samples are independent, and the likelihood is
exp(−S/2σ²) with the sum of squares S. If it is not, σ has Jeffreys' prior 1/σ and is integrated
out: the likelihood is then S^(−n/2).

Correlated residuals count as in the intervals of a fit. The noise has the covariance M of the
estimate's noise model along the directions U, in the space of observations, in which the parameters
change the record. Along all others it is independent, and n independent observations count as n/κ,
with κ the mean of M over its value for independent residuals, at least 1:

    S = ‖r + U (√κ s M^(−1/2) − I) Uᵀ r‖²,   s² = ‖r̂‖²/n

For a linear model the posterior is then Student's distribution whose quantiles are the ends of the
intervals.

Source: G. E. P. Box and G. C. Tiao (1973), "Bayesian inference in statistical analysis", section
2.7, for the integral over σ.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._fit.estimate import Estimate, P
from impactjax._optimise.linearisation import Matrix
from impactjax._problem.problem import Problem
from impactjax._types import Scalar

Rows = Float[Array, " observations"]
Jacobian = Float[Array, "observations parameters"]
Directions = Float[Array, "observations directions"]


class Likelihood(eqx.Module):
    """Likelihood of the residuals of one recording.

    - `directions`: U, orthonormal columns.
    - `change`: √κ s M^(−1/2) − I.
    - `count`: number of independent observations, n/κ.
    - `variance`: σ² if it is known.
    """

    directions: Directions
    change: Float[Array, "directions others"]
    count: Scalar
    variance: Scalar | None

    def log_density(self, residuals: Rows) -> Scalar:
        """Logarithm of the likelihood of residuals, up to a constant."""
        squares = jnp.sum(self.scaled(residuals) ** 2)
        if self.variance is None:
            return -self.count * jnp.log(squares) / 2
        return -squares / (2 * self.variance)

    def information(self, residuals: Rows, jacobian: Jacobian) -> Matrix:
        """Information about parameters, with the most likely σ if it is not known."""
        variance = self.variance
        if variance is None:
            variance = jnp.sum(self.scaled(residuals) ** 2) / self.count
        slopes = self.scaled(jacobian)
        return slopes.T @ slopes / variance

    def scaled(self, rows: Array) -> Array:
        """Rows as if their noise were independent."""
        return rows + self.directions @ (self.change @ (self.directions.T @ rows))


def likelihoods(estimate: Estimate[P]) -> tuple[Likelihood, ...]:
    """The likelihood of each recording of an estimate."""
    residuals, jacobian = jnp.asarray(estimate.residuals), jnp.asarray(estimate.jacobian)
    return tuple(
        _likelihood(
            problem,
            estimate.problem.share(i, residuals),
            estimate.problem.share(i, jacobian)[:, jnp.array(places)],
        )
        for i, (problem, places) in enumerate(estimate.problem.each_recording())
    )


def _likelihood(problem: Problem, residuals: Rows, jacobian: Jacobian) -> Likelihood:
    n = jnp.asarray(problem.observations, residuals.dtype)
    sizes = jnp.linalg.norm(jacobian, axis=0)
    scaled = jacobian / jnp.where(sizes > 0, sizes, 1.0)
    directions, *_ = jnp.linalg.svd(scaled, full_matrices=False)
    nothing = jnp.zeros((directions.shape[1],) * 2, residuals.dtype)
    if problem.is_classical():
        return Likelihood(directions, nothing, n, problem.variance())
    size = jnp.sum(residuals**2) / n
    relative, axes = jnp.linalg.eigh(problem.noise.spread(residuals, n, directions) / size)
    kappa = jnp.maximum(jnp.mean(relative), 1.0)
    change = axes * (jnp.sqrt(kappa / relative) - 1) @ axes.T
    return Likelihood(directions, change, n / kappa, None)
