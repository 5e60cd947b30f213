"""Likelihood of a linear mixed model at its maximum."""

import numpy as np

from impactjax._fit.mixed_model import (
    BELOW,
    BEYOND,
    RATIOS,
    Number,
    Observed,
    PerRatio,
    projected,
)
from impactjax._known import namespace
from impactjax._problem.prior import PriorRows


def marginal_likelihood(data: Observed, variance: Number | None, prior: PriorRows) -> Number:
    """Maximum over p, s and σ of the log-likelihood of a linear mixed model; over p and s if the
    noise's variance is known. Prior knowledge is weighed against the noise without it.
    """
    each, sizes = _likelihoods(data, variance)
    xp = namespace(each)
    if prior.deviations.shape[0]:
        each, _ = _likelihoods(data.with_prior(prior, sizes[xp.argmax(each)]), variance)
    return xp.max(each)


def _likelihoods(data: Observed, variance: Number | None) -> tuple[PerRatio, PerRatio]:
    """Maximum of the log-likelihood over p and σ for each ratio, and σ² there."""
    observed, jacobian, effects, count, _ = data
    xp = namespace(observed, jacobian, effects)
    part = projected(observed, jacobian, effects)
    strongest = xp.max(part.lengths) ** 2
    scale = xp.where(strongest > 0, strongest, 1.0)
    ratios = xp.exp(xp.linspace(-np.log(BELOW), np.log(BEYOND), 4 * RATIOS)) / scale
    ratios = xp.concatenate([xp.zeros_like(ratios[:1]), ratios])[:, None]
    squares = part.rest + xp.sum(part.parts**2 / (1 + ratios * part.lengths**2), axis=1)
    whole = xp.linalg.svd(effects, compute_uv=False) ** 2
    size = squares / count if variance is None else xp.full_like(squares, variance)
    determinant = xp.sum(xp.log(1 + ratios * whole), axis=1) + count * xp.log(2 * np.pi * size)
    return -(determinant + squares / size) / 2, size
