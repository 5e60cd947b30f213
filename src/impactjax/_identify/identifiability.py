"""What a recording tells about the parameters that were fitted to it."""

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._identify.information import Information, informed
from impactjax._known import known, namespace


@np.errstate(all="ignore")  # as JAX computes, without a warning
def identifiability(estimate: Estimate) -> Information:
    """What the recording of a fit tells about the parameters, around their estimates.

    The size of the noise is the one that agrees with the standard errors of the estimate, so that a
    widening for correlated residuals counts here too. An estimate that is not `usable` tells
    nothing. Works under `jit` and `vmap`.
    """
    estimate = known(estimate)
    xp, parameters = namespace(estimate), estimate.problem.handles()
    bounds = informed(parameters, estimate.values, estimate.jacobian).bounds
    usable = xp.isfinite(bounds) & xp.isfinite(estimate.standard_errors) & (bounds > 0)
    ratio = xp.where(usable, estimate.standard_errors / xp.where(usable, bounds, 1.0), xp.nan)
    noise = xp.nanmedian(xp.where(xp.any(usable), ratio, 1.0))
    noise = xp.where(estimate.usable, noise, xp.inf)
    return informed(parameters, estimate.values, estimate.jacobian / noise)
