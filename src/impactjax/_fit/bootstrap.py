"""Parametric bootstrap: intervals from refits to simulated recordings."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from impactjax._fit.estimate import Estimate
from impactjax._fit.search import Search, Searches
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.minimiser import Vector
from impactjax._problem.abstract_problem import AbstractProblem
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import Residuals

_TAILS = (0.025, 0.975)


class Bootstrap(eqx.Module):
    """Fits to recordings that were simulated with the values of an estimate.

    - `names`: names of the parameters.
    - `values`: fitted values for each simulated recording, in the parameters' own units.
    - `converged`: true for each fit that converged; the others do not count below.
    - `standard_errors`: standard deviation of the values.
    - `bias`: mean of the values minus the value with which the recordings were simulated.
    - `low`, `high`: ends of the middle 95 % of the values.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    values: Float[Array, "replicates parameters"]
    converged: Bool[Array, " replicates"]
    standard_errors: Vector
    bias: Vector
    low: Vector
    high: Vector


def bootstrap(
    estimate: Estimate[Problem],
    replicates: int = 200,
    *,
    seed: int = 0,
    optimiser: LevenbergMarquardt = LevenbergMarquardt(horizons=(1.0,)),
) -> Bootstrap:
    """Parametric bootstrap of an estimate: errors and intervals from fits to simulated recordings.

    Each replicate is the fitted motion plus random noise. The noise has the variance of the
    residuals and the correlation given by the estimate's `noise`; it is independent and has the
    sensor's variance if that is known. Each replicate is fitted again, starting from the estimate.
    No linearisation is involved, but the law is assumed to be true. Prior knowledge is drawn anew
    around the estimate. All fits form one batch.

    **Arguments:**

    - `estimate`: estimate of a single fit, or of several recordings together.
    - `replicates`: number of simulated recordings.
    - `seed`: random seed of the noise.
    - `optimiser`: settings of the fits.

    **Raises** `ValueError` for fewer than two replicates, and for an estimate with scatter from
    impact to impact, which the replicates would lack.

    Source: the parametric bootstrap of Efron and Tibshirani (1993), "An introduction to the
    bootstrap", chapter 6.
    """
    if replicates < 2:
        raise ValueError(f"Argument `replicates` must be at least 2, but it is {replicates}.")
    if estimate.scatter is not None:
        raise ValueError(
            "This estimate has scatter from impact to impact, and a bootstrap would draw none: fit "
            "the experiment with `scatter=NoScatter()`, or use the intervals of the estimate."
        )
    keys = jax.random.split(jax.random.key(seed), replicates)
    values, converged = _refits(estimate, optimiser, keys)
    counted = jnp.where(converged[:, None], values, jnp.nan)
    low, high = jnp.nanquantile(counted, jnp.array(_TAILS, values.dtype), axis=0)
    return Bootstrap(
        names=estimate.names,
        values=values,
        converged=converged,
        standard_errors=jnp.nanstd(counted, axis=0, ddof=1),
        bias=jnp.nanmean(counted, axis=0) - estimate.values,
        low=low,
        high=high,
    )


@eqx.filter_jit
def _refits(
    estimate: Estimate[Problem], optimiser: LevenbergMarquardt, keys: Key[Array, " replicates"]
) -> tuple[Float[Array, "replicates parameters"], Bool[Array, " replicates"]]:
    problem = estimate.problem
    start = problem.coordinates(estimate.values)
    parts = jnp.asarray(problem.parts(optimiser.horizons))

    def refit(key: Key[Array, ""]) -> tuple[Vector, Bool[Array, ""]]:
        drawn = simulated(problem, estimate.residuals, key)
        drawn = drawn.remeasured(estimate.values, jax.random.fold_in(key, 1))
        active = jnp.ones((1, start.shape[0]), bool)
        minimum = Search().minima(drawn, optimiser, Searches(start[None], active, parts))
        return problem.at(minimum.u[0]), minimum.converged[0]

    return jax.vmap(refit)(keys)


def simulated(
    problem: AbstractProblem, residuals: Residuals, key: Key[Array, ""]
) -> AbstractProblem:
    """The problem whose recording is the fitted motion plus random noise.

    A fit of p parameters to n observations reduces the residuals; the factor √(n/(n − p)) corrects
    for it.
    """
    n, p = problem.observations.astype(residuals.dtype), len(problem.names)
    known = problem.variance()
    if known is not None and problem.is_classical():
        errors = jnp.sqrt(known) * jax.random.normal(key, residuals.shape, residuals.dtype)
    else:
        errors = problem.assumed().noise.drawn(key, residuals, n) * jnp.sqrt(n / (n - p))
    return problem.shifted(jnp.where(problem.valid, errors - residuals, 0.0))
