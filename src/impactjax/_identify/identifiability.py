"""The verb `identifiability`: the information in a recording about the fitted parameters."""

import numpy as np

from impactjax._fit.estimate import Estimate, P
from impactjax._identify.information import Information, informed
from impactjax._known import known, namespace
from impactjax._refusal import check_kind


@np.errstate(all="ignore")  # no warnings, as in JAX
def identifiability(estimate: Estimate[P]) -> Information:
    """Information in the recording of a fit about the parameters, around their estimates. Prior
    knowledge of the experiment is part of it, as further observations.

    The noise is scaled to agree with the standard errors of the estimate, so that correlated
    residuals count here as well. Scatter from impact to impact is part of it. An estimate that is
    not `usable` contains no information. Works under `jit` and `vmap`.
    """
    check_kind("estimate", estimate, Estimate, "fit(experiment)")
    estimate = known(estimate)
    xp, parameters, scatter = namespace(estimate), estimate.problem.handles(), estimate.scatter
    jacobian = estimate.jacobian if scatter is None else scatter.jacobian
    rows, weight = estimate.problem.prior_rows(estimate.values), estimate.problem.prior_weight()
    if weight is not None:
        jacobian = xp.concatenate([jacobian, xp.sqrt(weight) * rows.slopes])
    bounds = informed(parameters, estimate.values, jacobian).bounds
    usable = xp.isfinite(bounds) & xp.isfinite(estimate.standard_errors) & (bounds > 0)
    ratios = xp.where(usable, estimate.standard_errors / xp.where(usable, bounds, 1.0), xp.nan)
    noise = xp.nanmedian(xp.where(xp.any(usable), ratios, 1.0))
    if scatter is not None:  # the size of scatter is uncertain, and each error depends on it anew
        noise = xp.where(usable, ratios, noise)
    noise = xp.where(estimate.usable, noise, xp.inf)
    return informed(parameters, estimate.values, jacobian / noise)
