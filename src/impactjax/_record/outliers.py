"""Outliers: samples that jump away from the motion and back."""

import numpy as np

_WINDOW = 5  # samples of the running median; up to two in a row may be wrong
_NOISE = 8.0  # least distance from the running median, in standard deviations of the noise
_STEPS = 3.0  # least distance, in the largest change of the running median between samples


def spikes(values: np.ndarray) -> np.ndarray:
    """Mask of the samples that are far from the running median: farther than noise, and farther
    than the fastest motion in the record moves in three samples.

    Source: Hampel's identifier, with a bound for motion: Pearson, IEEE Transactions on Control
    Systems Technology 10, 55 (2002).
    """
    if len(values) < 3 * _WINDOW:
        return np.zeros(len(values), bool)
    from scipy import ndimage

    middle = ndimage.median_filter(values, _WINDOW, mode="mirror")
    distance = np.abs(values - middle)
    usual = float(np.median(distance)) / 0.6745
    fastest = float(np.max(np.abs(np.diff(middle))))
    return distance > max(_NOISE * usual, _STEPS * fastest)
