"""Criterion of a model that plainly does not describe its recording."""

from jaxtyping import Float

from impactjax._known import AnyArray, namespace

_UNEXPLAINED, _SMOOTH = 0.05, 0.8  # share of the motion, and lag-1 autocorrelation, that are missed
_WILD = 1.5  # share of the motion that counts as missed with any autocorrelation


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
