"""What a recording tells about the parameters that were fitted to it."""

import equinox as eqx
import jax.numpy as jnp

from impactjax._fit.estimate import Estimate
from impactjax._identify.information import Information, informed


@eqx.filter_jit
def identifiability(estimate: Estimate) -> Information:
    """What the recording of a fit tells about the parameters, around their estimates.

    The size of the noise is the one that agrees with the standard errors of the estimate, so that a
    widening for correlated residuals counts here too. Works under `jit` and `vmap`.
    """
    parameters = estimate.problem.handles()
    bounds = informed(parameters, estimate.values, estimate.jacobian).bounds
    usable = jnp.isfinite(bounds) & jnp.isfinite(estimate.standard_errors) & (bounds > 0)
    ratio = jnp.where(usable, estimate.standard_errors / jnp.where(usable, bounds, 1.0), jnp.nan)
    noise = jnp.where(jnp.any(usable), jnp.nanmedian(ratio), 1.0)
    return informed(parameters, estimate.values, estimate.jacobian / noise)
