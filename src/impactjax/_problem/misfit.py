"""Rule by which a fit plainly misses its recording."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._record.abstract_recording import AbstractRecording
from impactjax._types import Scalar

_UNEXPLAINED, _SMOOTH = 0.05, 0.8  # share of the motion, and autocorrelation, of a wrong model
_WILD = 1.5  # share of the motion that no noise can be


def misfit(recording: AbstractRecording, residuals: Float[Array, " observations"]) -> Scalar:
    """Share of a record's standard deviation that a fit leaves, where that is so much, and so
    little like noise, that the model does not describe the record; 0 where it is not [1].

    Impact times have no motion to compare with.
    """
    variation, left = recording.variation(), jnp.sum(residuals**2)
    pairs = jnp.sum(residuals[1:] * residuals[:-1]) / jnp.where(left > 0, left, 1.0)
    share = jnp.sqrt(left / jnp.where(variation > 0, variation, 1.0))
    missed = ((share > _UNEXPLAINED) & (pairs > _SMOOTH)) | (share > _WILD)
    return jnp.where(missed & (variation > 0) & jnp.isfinite(left), share, 0.0)
