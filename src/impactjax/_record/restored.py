"""Places from a velocity that was computed as their differences: a sum restores them exactly."""

import numpy as np

from impactjax._record.sample_noise import noise_of_samples

_EVEN = 1e-3  # deviation of an interval from the mean, relative to it


def restored(ts: np.ndarray, values: np.ndarray, impacts: np.ndarray) -> np.ndarray | None:
    """The places whose differences a recorded velocity seems to be, as of `numpy.diff` or
    `numpy.gradient`, zero at the median of the `impacts` [s]; `None` if it does not seem to be, or
    if the samples are not even.

    A difference smooths an impact over two intervals, but loses nothing: sums of neighbouring
    differences, or of every second central one, are the places with their own noise.
    """
    intervals = np.diff(ts)
    interval = float(np.mean(intervals))
    uneven = np.max(np.abs(intervals - interval)) > _EVEN * interval
    if uneven or not np.all(np.isfinite(values)):
        return None
    lag = noise_of_samples(values).difference_lag
    if lag == 0:
        return None
    places = (_of_neighbours if lag == 1 else _of_central)(values) * interval
    return places - np.median(np.interp(impacts, ts, places))


def _of_neighbours(differences: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(differences[:-1])])


def _of_central(differences: np.ndarray) -> np.ndarray:
    """Sums of every second difference. The constant between even and odd places is that with the
    smallest third differences, in which it alternates.
    """
    places = np.zeros(len(differences))
    for first in (0, 1):
        steps = 2 * differences[first + 1 : -1 : 2]
        places[first + 2 :: 2] = np.cumsum(steps)
    third = np.diff(places, 3)
    sign = np.where(np.arange(len(third)) % 2, -1.0, 1.0)
    places[1::2] -= np.median(sign * third) / 4
    return places
