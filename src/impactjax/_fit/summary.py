"""From a minimum to an estimate: covariance, intervals, criteria."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from scipy import special

from impactjax._fit.estimate import Estimate
from impactjax._fit.levenberg_marquardt import Minimum
from impactjax._fit.problem import Answer, Problem
from impactjax._fit.system import handles
from impactjax._fit.verdict import Verdict

_NORMAL = float(special.ndtri(0.975))


@eqx.filter_jit
def summarise(problem: Problem, minimum: Minimum[Answer], start_costs: Array) -> Estimate:
    """The estimate that a minimum stands for, in the approximation of small errors."""
    residuals, jacobian = minimum.quadratic.answer.residuals, minimum.quadratic.answer.jacobian
    assert jacobian is not None
    count, p = problem.recording.observations, len(problem.names)
    n = count.astype(residuals.dtype)
    squares = 2 * minimum.quadratic.cost
    values = problem.values(minimum.u)
    known = problem.system.sensor.variance()
    variance = squares / (n - p) if known is None else known
    covariance = variance * _inverse(minimum.quadratic.information)
    errors = jnp.sqrt(jnp.diagonal(covariance))
    quantiles = special.stdtrit(np.arange(residuals.shape[0] + 1), 0.975)
    quantile = jnp.asarray(quantiles, errors.dtype)[count - p] if known is None else _NORMAL
    half = quantile * errors
    places = handles(problem.system)
    lowest = jnp.array([places[name].allowed.low for name in problem.names], values.dtype)
    highest = jnp.array([places[name].allowed.high for name in problem.names], values.dtype)
    low, high = jnp.maximum(values - half, lowest), jnp.minimum(values + half, highest)
    size = squares / n if known is None else known
    likelihood = -(n * jnp.log(2 * np.pi * size) + squares / size) / 2
    found = p + (known is None)
    return Estimate(
        problem=problem,
        values=values,
        standard_errors=errors,
        low=low,
        high=high,
        covariance=covariance,
        verdicts=verdicts(low > lowest, high < highest),
        residuals=residuals,
        jacobian=jacobian,
        impacts=minimum.quadratic.answer.impacts,
        rms=jnp.sqrt(squares / n),
        aic=2 * found - 2 * likelihood,
        bic=jnp.log(n) * found - 2 * likelihood,
        converged=minimum.converged,
        iterations=minimum.iterations,
        start_costs=start_costs,
    )


def verdicts(below: Array, above: Array) -> Array:
    """Verdicts from whether the parameters are bounded from below and from above."""
    both = jnp.where(below & above, Verdict.IDENTIFIED, Verdict.ONE_SIDED)
    return jnp.where(below | above, both, Verdict.NOT_IDENTIFIED).astype(jnp.int32)


def _inverse(information: Array) -> Array:
    """The inverse, scaled first; what carries no information at all gets an infinite variance."""
    diagonal = jnp.diagonal(information)
    informative = diagonal > 0
    scale = jnp.where(informative, jnp.sqrt(jnp.where(informative, diagonal, 1.0)), 1.0)
    scaled = information / (scale[:, None] * scale[None, :])
    scaled = jnp.where(informative[:, None] & informative[None, :], scaled, jnp.eye(len(scale)))
    eigenvalues, vectors = jnp.linalg.eigh(scaled)
    floor = len(scale) * jnp.finfo(scale.dtype).eps
    inverse = (vectors / jnp.maximum(eigenvalues, floor)) @ vectors.T
    inverse = inverse / (scale[:, None] * scale[None, :])
    return inverse + jnp.diag(jnp.where(informative, 0.0, jnp.inf))
