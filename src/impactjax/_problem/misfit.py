"""Criteria of a model that does not describe its recording."""

import math

from jaxtyping import Bool, Float

from impactjax._known import AnyArray, namespace

_UNEXPLAINED, _SMOOTH = 0.05, 0.8  # share of the motion, and lag-1 autocorrelation, that are missed
_WILD = 1.5  # share of the motion that counts as missed with any autocorrelation
_AT_IMPACTS = 2.0  # ratio of the rms of residuals at impacts to that of all others
STATED = 1.5  # ratio of the rms of residuals to the stated noise
_DEVIATIONS = 4.3  # least ratio, in standard deviations of its logarithm

Mask = Bool[AnyArray, " observations"]
Number = Float[AnyArray, ""]


def misfit(
    variation: Float[AnyArray, ""], residuals: Float[AnyArray, " observations"]
) -> Float[AnyArray, ""]:
    """Share of a record's standard deviation that a fit leaves unexplained [1], if the model
    plainly misses the record; else 0.

    A record is missed if this share √(Σ r² / Σ (y − ȳ)²) exceeds 5 % with a lag-1 autocorrelation
    of the residuals r above 0.8, or if it exceeds 150 %. Impact times are never missed: there is no
    motion to compare with, and their variation is 0.

    **Arguments:**

    - `variation`: sum Σ (y − ȳ)² of squared deviations of the record from its mean.
    """
    left = (residuals**2).sum()
    xp = namespace(variation, left)
    pairs = xp.sum(residuals[1:] * residuals[:-1]) / xp.where(left > 0, left, 1.0)
    share = xp.sqrt(left / xp.where(variation > 0, variation, 1.0))
    missed = ((share > _UNEXPLAINED) & (pairs > _SMOOTH)) | (share > _WILD)
    return xp.where(missed & (variation > 0) & xp.isfinite(left), share, 0.0)


def exceeds_noise(
    residuals: Float[AnyArray, " observations"],
    valid: Mask,
    at_impacts: Mask,
    variance: Number | None,
) -> Bool[AnyArray, ""]:
    """True if residuals are larger than the noise: those at impacts than all others, by a factor of
    2 in the root mean square, or all of them than the stated noise, by a factor of 1.5.

    The factor must be significant, too: the logarithm of the ratio of two sample standard
    deviations, of n and m independent normal numbers, has the variance 1/2n + 1/2m.

    **Arguments:**

    - `valid`: mask of the residuals that count.
    - `at_impacts`: mask of those beside an impact.
    - `variance`: stated variance of the noise, if it is known.
    """
    here, count = _mean_square(residuals, valid & at_impacts)
    rest, others = _mean_square(residuals, valid & ~at_impacts)
    at_some = _exceeds(here, rest, 1 / count + 1 / others, _AT_IMPACTS)
    if variance is None:
        return at_some
    every, number = _mean_square(residuals, valid)
    return at_some | _exceeds(every, variance, 1 / number, STATED)


def _mean_square(residuals: AnyArray, mask: AnyArray) -> tuple[Number, Number]:
    """Mean square of some residuals, and their number, which counts as 1 if there are none."""
    xp = namespace(residuals, mask)
    count = xp.maximum(xp.sum(mask), 1).astype(residuals.dtype)
    return xp.sum(xp.where(mask, residuals**2, 0.0)) / count, count


def _exceeds(square: Number, other: Number, inverse: Number, factor: float) -> Bool[AnyArray, ""]:
    """True if a mean square exceeds another one, by the square of a factor and significantly.

    **Arguments:**

    - `inverse`: sum 1/n + 1/m of the inverse numbers of residuals.
    """
    xp = namespace(square, other, inverse)
    positive = (square > 0) & (other > 0) & xp.isfinite(square)
    log = xp.log(xp.where(positive, square, 1.0) / xp.where(positive, other, 1.0)) / 2
    return (log > math.log(factor)) & (log > _DEVIATIONS * xp.sqrt(inverse / 2))
