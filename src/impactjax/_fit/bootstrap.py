"""Intervals from recordings that might as well have been made."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from impactjax._fit.estimate import Estimate
from impactjax._fit.search import Search, Searches
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.minimiser import Vector
from impactjax._problem.problem import AbstractProblem, Residuals

_TAILS = (0.025, 0.975)


class Bootstrap(eqx.Module):
    """Fits to recordings that were simulated with the values of an estimate.

    - `names`: of the parameters.
    - `values`: found in each simulated recording, in the parameters' own units.
    - `converged`: whether the fit of each came to rest; the others do not count below.
    - `standard_errors`: standard deviation of the values.
    - `bias`: mean of the values less that with which they were simulated.
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
    estimate: Estimate,
    replicates: int = 200,
    *,
    seed: int = 0,
    optimiser: LevenbergMarquardt = LevenbergMarquardt(horizons=(1.0,)),
) -> Bootstrap:
    """How the values of an estimate vary from record to record, by simulating records.

    Each is the fitted motion with fresh noise like the residuals, of their size and, as far as the
    estimate's `noise` says so, correlated like them; independent and of the sensor's size, if that
    is known. It is fitted again, from the estimate. Nothing is taken for small or linear, but the
    law is taken for true. All fits are one batch.

    **Arguments:**

    - `estimate`: of a single fit, or of several recordings together.
    - `replicates`: how many records.
    - `seed`: of the noise.
    - `optimiser`: for the fits.

    **Raises** `ValueError` for fewer than two replicates.

    Source: the parametric bootstrap of Efron and Tibshirani (1993), "An introduction to the
    bootstrap", chapter 6.
    """
    if replicates < 2:
        raise ValueError(f"Argument `replicates` must be at least 2, but it is {replicates}.")
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
    estimate: Estimate, optimiser: LevenbergMarquardt, keys: Key[Array, " replicates"]
) -> tuple[Float[Array, "replicates parameters"], Bool[Array, " replicates"]]:
    problem = estimate.problem
    start = problem.unbounded(estimate.values)
    parts = jnp.asarray(problem.parts(optimiser.horizons))

    def refit(key: Key[Array, ""]) -> tuple[Vector, Bool[Array, ""]]:
        simulated = _simulated(problem, estimate.residuals, key)
        active = jnp.ones((1, start.shape[0]), bool)
        minimum = Search().minima(simulated, optimiser, Searches(start[None], active, parts))
        return problem.values(minimum.u[0]), minimum.converged[0]

    return jax.vmap(refit)(keys)


def _simulated(
    problem: AbstractProblem, residuals: Residuals, key: Key[Array, ""]
) -> AbstractProblem:
    """The problem with the fitted motion and fresh noise as what was recorded.

    Fitting has taken a share of the residuals away, p of n degrees of freedom, which is given back.
    """
    n, p = problem.observations.astype(residuals.dtype), len(problem.names)
    known = problem.variance()
    if known is not None and problem.is_classical():
        errors = jnp.sqrt(known) * jax.random.normal(key, residuals.shape, residuals.dtype)
    else:
        errors = problem.assumed().noise.drawn(key, residuals, n) * jnp.sqrt(n / (n - p))
    return problem.shifted(jnp.where(problem.valid, errors - residuals, 0.0))
