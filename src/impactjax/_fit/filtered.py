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
    cutoffs = rate * np.geomspace(_HIGHEST, _LOWEST, _COUNT)
    return [
        FilteredRecord(Butterworth(float(f)), np.where(valid, _filtered(shown, rate, f) - shown, 0))
        for f in cutoffs
    ]


def _filtered(values: Column, rate: float, cutoff: float) -> Column:
    """The output of a Butterworth filter of order 2, whose input was a line before the first
    sample.
    """
    count, omega = len(values), 2 * np.pi * cutoff
    ts = np.arange(count) / rate
    slope = (values[1] - values[0]) * rate
    line = values[0] + slope * ts
    s = 1j * np.fft.rfftfreq(2 * count, 1 / rate) * 2 * np.pi / omega
    response = 1 / (1 + np.sqrt(2) * s + s**2)
    rest = np.fft.irfft(response * np.fft.rfft(values - line, 2 * count), 2 * count)[:count]
    return line - slope * np.sqrt(2) / omega + rest
