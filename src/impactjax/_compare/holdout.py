"""Scores of a fit against the end of its record, which was held out."""

from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._fit.estimate import Estimate
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import AbstractRecording, Residuals

R = TypeVar("R", bound=AbstractRecording)


class Prediction(NamedTuple):
    """Prediction of the observations that a fit has not seen.

    - `count`: number of those that count.
    - `rms`: root mean square of predicted minus recorded, in the recording's SI unit; infinite if
      the simulation failed.
    """

    count: int
    rms: float


def check_holdout(share: float) -> None:
    """Raises `ValueError` for a share of a recording that cannot be held out."""
    if not 0 <= share < 1:
        raise ValueError(
            f"Argument `holdout` is the share of the observations to hold out, from 0 to less than "
            f"1, but it is {share}."
        )


def fitted_part(recording: R, share: float) -> R:
    """The recording without the last `share` of its observations that count."""
    instants = np.asarray(recording.instants)[np.asarray(recording.valid)]
    kept = max(len(instants) - round(share * len(instants)), 1)
    return recording.between(float(recording.begin), float(instants[kept - 1]))


def prediction(estimate: Estimate[Problem], recording: AbstractRecording) -> Prediction:
    """The prediction of the observations of a recording after those that were fitted."""
    problem = eqx.tree_at(lambda each: each.recording, estimate.problem, recording)
    late = np.asarray(recording.instants) > float(estimate.problem.recording.end)
    own = np.asarray(_residuals(problem, jnp.asarray(estimate.values)))
    own = own[late & np.asarray(recording.valid)]
    rms = float(np.sqrt(np.mean(own**2))) if np.isfinite(own).all() else np.inf
    return Prediction(len(own), rms)


@eqx.filter_jit
def _residuals(problem: Problem, values: Float[Array, " parameters"]) -> Residuals:
    return problem.residuals(values)
