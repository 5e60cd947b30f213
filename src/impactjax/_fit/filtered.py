"""A low-pass filter that a fit did not assume: does the record ask for it?

The simulated record e + y is filtered by Butterworth filters of several cutoffs. The score test of
the share λ of the change by the filter tells which one lowers AIC the most.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._fit.estimate import Estimate
from impactjax._known import AnyArray
from impactjax._problem.problem import Problem
from impactjax._record.recording import Recording
from impactjax._sensor.filtered_samples import filtered_samples
from impactjax._sensor.low_pass import Butterworth

_HIGHEST, _LOWEST, _COUNT = 0.4, 0.005, 16  # cutoffs tried, relative to the sampling rate
_UNEVEN = 1e-3  # relative difference of sampling intervals that rules out the test

Column = Float[AnyArray, " observations"]


class FilteredRecord(NamedTuple):
    """Change of a simulated record by a low-pass filter.

    - `low_pass`: the filter.
    - `column`: filtered minus unfiltered record.
    """

    low_pass: Butterworth
    column: Column


def filtered_records(estimate: Estimate[Problem]) -> list[FilteredRecord]:
    """Changes of the simulated record by filters of several cutoffs; none for a sensor with a
    low-pass, and for a recording that is no place at evenly spaced times.
    """
    problem = estimate.problem
    recording = problem.recording
    if problem.system.sensor.low_pass is not None or not isinstance(recording, Recording):
        return []
    ts, valid = np.asarray(recording.ts), np.asarray(recording.valid)
    steps = np.diff(ts)
    if not recording.shows_place or np.ptp(steps) > _UNEVEN * np.mean(steps):
        return []
    shown = np.asarray(recording.values) + np.asarray(estimate.residuals)
    shown = np.interp(ts, ts[valid], shown[valid])
    rate = 1 / float(np.mean(steps))
    filters = [Butterworth(float(f)) for f in rate * np.geomspace(_HIGHEST, _LOWEST, _COUNT)]
    changes = [filtered_samples(low_pass, shown, rate) - shown for low_pass in filters]
    return [
        FilteredRecord(low_pass, np.where(valid, change, 0.0))
        for low_pass, change in zip(filters, changes, strict=True)
    ]
