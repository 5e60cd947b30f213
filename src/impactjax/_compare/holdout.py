"""Scores of a fit against the end of its record, which was held out."""

from typing import NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._fit.search import Search
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import AbstractRecording

R = TypeVar("R", bound=AbstractRecording)


class Prediction(NamedTuple):
    """Prediction of the observations that a fit has not seen.

    - `observations`: number of those that count.
    - `rms`: root mean square of predicted minus recorded, in the recording's SI unit; infinite if
      the simulation failed.
    """

    observations: int
    rms: float


def check_holdout(share: float) -> None:
    """Raises `ValueError` for a share of a recording that cannot be held out."""
    if not 0 <= share < 1:
        raise ValueError(
            f"Argument `holdout` is the share of the observations to hold out, from 0 to less than "
            f"1, but it is {share}."
        )


def fitted_part(recording: R, share: float) -> R:
    """The recording whose last `share` of the observations that count do not count any more."""
    valid, instants = np.asarray(recording.valid), np.asarray(recording.instants)
    kept = instants[valid]
    count = max(len(kept) - round(share * len(kept)), 1)
    mask = jnp.asarray(valid & (instants <= kept[count - 1]))
    return eqx.tree_at(lambda each: each.valid, recording, mask)


def prediction(
    estimate: Estimate[Problem],
    recording: AbstractRecording,
    optimiser: LevenbergMarquardt,
    search: Search,
) -> Prediction:
    """The prediction of the observations of a recording that were not fitted. Impacts that were
    fitted have their expected deviations; later ones follow the law.
    """
    unseen = np.asarray(recording.valid) & ~np.asarray(estimate.problem.valid)
    whole = eqx.tree_at(lambda each: each.recording, estimate.problem, recording)
    problem = whole.padded().of_record()
    if estimate.scatter is not None:
        problem = problem.scattered(jnp.asarray(estimate.scatter.logarithms))
    u, parts = problem.coordinates(np.asarray(estimate.values)), problem.parts(optimiser.horizons)
    found = search.evaluate(problem, jnp.asarray(u), jnp.asarray(parts), jnp.zeros((), bool))
    left = np.asarray(found.answer.residuals)[: len(unseen)][unseen]
    rms = float(np.sqrt(np.mean(left**2))) if np.isfinite(left).all() else np.inf
    return Prediction(len(left), rms)
