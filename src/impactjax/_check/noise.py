"""Noise of a record, from the record alone."""

import numpy as np

from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.recording import Recording
from impactjax._record.sample_noise import QUARTILE, Noise, noise_of_samples


def noise_of(recording: AbstractRecording) -> Noise:
    """Noise of a record: of samples from third differences, of impact times from the scatter of the
    flights about a smooth course, which includes that of the restitution.
    """
    if not isinstance(recording, Recording):
        return Noise(_scatter(np.asarray(recording.instants), np.asarray(recording.valid)))
    values = np.asarray(recording.values)[np.asarray(recording.valid)]
    return noise_of_samples(values.astype(float))


def _scatter(times: np.ndarray, valid: np.ndarray) -> float:
    """Standard deviation of times, from the flights between impacts of which none was missed."""
    number = np.flatnonzero(valid[1:] & valid[:-1])
    if len(number) < 5:
        return 0.0
    flights = np.diff(times)[number]
    course = np.polynomial.Polynomial.fit(number, np.log(flights), 2)
    left = flights - np.exp(course(number))
    return float(np.median(np.abs(left))) / QUARTILE / np.sqrt(2)
