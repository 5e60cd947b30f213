"""Outliers that only a fit shows: single samples beside impacts, where the motion is fast."""

import dataclasses

import numpy as np

from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Change, Settings, fit_models, ranked
from impactjax._fit.estimate import Estimate
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.read_recording import count_of

_ROUNDS = 3  # times that all models are fitted again
_LARGE = 5.0  # least residual, relative to the root mean square of all
_ROUNDING = 1e-6  # residual, relative to the span of the record, that is none


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
) -> Change | None:
    """All models, fitted again without the samples whose residuals in the best fit jump away from
    those beside them and back; `None` if there are none, or if no fit describes the record. Fits
    are repeated, since a large outlier may hide others.
    """
    found = list[np.ndarray]()
    for _ in range(_ROUNDS):
        best = ranked(fits)[0]
        wrong = outliers(best.estimate, own[best.name].recording)
        if not wrong.any():
            break
        found.append(wrong)
        own = {
            name: dataclasses.replace(each, recording=each.recording.without(wrong))
            for name, each in own.items()
        }
        fits = fit_models(own, settings, fits)
    if not found:
        return None
    said = f"{count_of(np.any(found, axis=0), 'sample')} far from the best fit, and left out."
    return Change(own, fits, said)
