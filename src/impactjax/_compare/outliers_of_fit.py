"""Outliers that only a fit shows: single samples beside impacts, where the motion is fast."""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import numpy as np

from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Settings, fit_models, ranked
from impactjax._fit.estimate import Estimate
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.read_recording import count_of

_ROUNDS = 3  # times that all models are fitted again
_LARGE = 5.0  # least residual, relative to the root mean square of all
_ROUNDING = 1e-6  # residual, relative to the span of the record, that is none


class Cleaned(NamedTuple):
    """Experiments without some samples, their fits, and the sentence on them."""

    own: dict[str, Experiment]
    fits: dict[str, Fitted]
    sentence: str


def outliers(estimate: Estimate[Problem], recording: AbstractRecording) -> np.ndarray:
    """Mask of the outliers among the residuals. They are large beside all others, too: where a
    record stands still, or has steps, the noise from sample to sample is too small a measure.
    """
    residuals, (lowest, highest) = np.asarray(estimate.residuals), recording.span()
    if not bool(estimate.usable):
        return np.zeros(residuals.shape, bool)
    least = max(_LARGE * float(estimate.rms), _ROUNDING * (highest - lowest))
    return recording.outliers(residuals) & (np.abs(residuals) > least)


def without_outliers(
    own: dict[str, Experiment], fits: dict[str, Fitted], settings: Settings
) -> Cleaned | None:
    """All models, fitted again without the samples whose residuals in the best fit jump away from
    those beside them and back; `None` if there are none, or if no fit describes the record. Fits
    are repeated, since a large outlier may hide others.
    """
    out = np.zeros(1, bool)
    for _ in range(_ROUNDS):
        best = ranked(fits)[0]
        wrong = outliers(best.estimate, own[best.name].recording)
        if not wrong.any():
            break
        out = out | wrong
        own = {name: _without(each, wrong) for name, each in own.items()}
        fits = fit_models(own, settings, fits)
    said = f"{count_of(out, 'sample')} far from the best fit, and left out."
    return Cleaned(own, fits, said) if out.any() else None


def _without(experiment: Experiment, wrong: np.ndarray) -> Experiment:
    recording = experiment.recording
    valid = np.asarray(recording.valid) & ~wrong
    clean = eqx.tree_at(lambda each: each.valid, recording, valid)
    return dataclasses.replace(experiment, recording=clean)
