"""The verb `posterior`: draws from the posterior distribution of the parameters of an estimate."""

import math
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Key

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.evaluation import answer_at
from impactjax._identify.convergence import diagnosis
from impactjax._identify.density import Density, density_of
from impactjax._identify.nuts import Draws, Length, Place, Progress, sampled
from impactjax._optimise.linearisation import Vector
from impactjax._problem.loss import Squares
from impactjax._refusal import check_function, check_kind, whole

if TYPE_CHECKING:
    import xarray

_APART = 1.5  # standard deviations of the starts of the chains
_FALL = 5.0  # largest fall of the log-density at a start, for each parameter
_HALVINGS = 8
_FEWEST = 4  # draws of which a convergence can be told


def posterior(
    estimate: Estimate[P],
    draws: int = 1000,
    *,
    chains: int = 4,
    warmup: int = 500,
    seed: int = 0,
    progress: Progress = lambda _, __: None,
) -> "xarray.DataTree":
    """Posterior distribution of the parameters, by the no-U-turn sampler of NumPyro.

    The density of the parameters v, given the residuals r(v), is

        p(v) ∝ exp(−‖r‖²/2σ²) if the sensor's σ is known, else ‖r‖^(−n) with Jeffreys' prior of σ,

    times the prior knowledge. All other parameters are flat over their ranges, in
    their own units. Correlated residuals count as in the intervals of the estimate: near it, their
    covariance is that of its noise model, and n observations count as fewer independent ones.

    The chains start around the estimate, about 1.5 standard errors from it, in coordinates in which
    its covariance is the identity. The gradient is that of the forward Jacobian. A simulation that
    fails has density 0. Another recording of the same length does not compile again.

    Needs the packages of `pip install 'impactjax[posterior]'`.

    **Arguments:**

    - `estimate`: estimate of a single fit, or of several recordings together. Beyond chance, draws
      depend on it only through the correlation of its residuals.
    - `draws`: number of draws from each chain.
    - `chains`: number of chains, at least 2.
    - `warmup`: number of transitions before, which adapt the step size and the mass matrix.
    - `seed`: random seed.
    - `progress`: function called with the transitions that are done, and with their number.

    **Returns** an ArviZ `DataTree` (`xarray.DataTree`): group `posterior` with a variable for each
    parameter, with the dimensions `chain` and `draw` and the attribute `unit`, and group
    `sample_stats`. Its attribute `diagnosis` says in words whether the chains converged: R-hat
    above 1.01, an effective sample size below 400 or a divergence gives a warning.

    **Raises** `ValueError` for an estimate that is not `usable`, has another loss than `Squares()`
    or scatter from impact to impact, and for a parameter whose interval is open on a side on which
    its range has no end: a flat prior then has no posterior. `ImportError` without the packages.

    Source: M. D. Hoffman and A. Gelman (2014), "The no-U-turn sampler", Journal of Machine Learning
    Research 15, 1593; A. Vehtari et al. (2021), Bayesian Analysis 16, 667, for R-hat.
    """
    _check_installed()
    whole("draws", draws, _FEWEST)
    whole("chains", chains, 2)
    whole("warmup", warmup, 0)
    whole("seed", seed, 0)
    check_function("progress", progress)
    _check_estimate(estimate)
    for_starts, for_chains = jax.random.split(jax.random.key(seed))
    keys = jax.random.split(for_chains, chains)
    with jax.numpy_dtype_promotion("standard"):  # as NumPyro needs it
        density = density_of(estimate)
        starts = _starts(estimate, density, jax.random.split(for_starts, chains))
        found = sampled(density, starts, keys, Length(warmup, draws), progress)
        return _tree(estimate, density, found)


def _check_estimate(estimate: Estimate[P]) -> None:
    """Raises `ValueError` for an estimate without a posterior density."""
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    estimate.check_single()
    if not bool(estimate.usable):
        raise ValueError(f"This estimate has no posterior: {estimate.cause}.")
    if estimate.scatter is not None:
        raise ValueError(
            "This estimate has scatter from impact to impact, over which the posterior does not "
            "integrate: fit the experiment with `scatter=NoScatter()`, or use the estimate's "
            "intervals."
        )
    if not all(isinstance(each.loss, Squares) for each, _ in estimate.problem.each_recording()):
        raise ValueError(
            "A posterior needs a normal likelihood: fit the experiment with `loss=Squares()`."
        )
    each = zip(estimate.problem.handles().items(), estimate.low, estimate.high, strict=True)
    for (name, handle), low, high in each:
        for side, end, limit in (
            ("above", float(high), handle.allowed.high),
            ("below", float(low), handle.allowed.low),
        ):
            if math.isinf(limit) and math.isinf(end):
                raise ValueError(
                    f"The record does not bound `{name}` from {side}, so that a flat prior has no "
                    "posterior: give the experiment `bounds`, or `priors`."
                )


def _check_installed() -> None:
    try:
        import arviz_base as arviz_base
        import arviz_stats as arviz_stats
        import numpyro as numpyro
    except ImportError as error:
        raise ImportError(
            "A posterior needs NumPyro and ArviZ: `pip install 'impactjax[posterior]'`."
        ) from error


def _starts(estimate: Estimate[P], density: Density, keys: Key[Array, " chains"]) -> list[Place]:
    """Starts around the centre, closer to it where the density falls too far."""
    centre = jnp.zeros_like(density.centre)
    top = _place(estimate, density, centre)
    least = top.log_density - _FALL * len(centre)
    found = []
    for key in keys:
        away = _APART * jax.random.normal(key, centre.shape, centre.dtype)
        places = (_place(estimate, density, away / 2**i) for i in range(_HALVINGS))
        found.append(next((each for each in places if each.log_density >= least), top))
    return found


def _place(estimate: Estimate[P], density: Density, at: Vector) -> Place:
    """A point with its density, by the compiled evaluation of the fit."""
    problem, count = estimate.problem, estimate.residuals.shape[-1]
    answer = answer_at(problem.padded(), density.values(at)[0])
    assert answer.jacobian is not None
    own = answer._replace(residuals=answer.residuals[:count], jacobian=answer.jacobian[:count])
    return Place(at, *density.log_density(at, own))


def _tree(estimate: Estimate[P], density: Density, draws: Draws) -> "xarray.DataTree":
    """The draws as ArviZ has them."""
    from arviz_base import from_dict

    values = np.asarray(jax.jit(jax.vmap(jax.vmap(lambda at: density.values(at)[0])))(draws.place))
    stats = {
        "lp": draws.log_density,
        "energy": draws.energy,
        "diverging": draws.diverging,
        "n_steps": draws.steps,
        "acceptance_rate": draws.acceptance,
        "step_size": draws.step_size,
    }
    names = estimate.names
    tree = from_dict(
        {
            "posterior": {name: values[..., i] for i, name in enumerate(names)},
            "sample_stats": stats,
        }
    )
    for name, unit in zip(names, estimate.units, strict=True):
        tree["posterior"].dataset[name].attrs["unit"] = unit
    tree.attrs["diagnosis"] = diagnosis(tree, bool(estimate.doubtful))
    return tree
