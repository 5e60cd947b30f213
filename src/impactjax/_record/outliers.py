"""Samples that jump away from the motion and back at once."""

import numpy as np

_WINDOW = 5  # samples; up to two in a row may be wrong
_NOISE = 8.0  # usual distances from the middle of their neighbours
_STEPS = 3.0  # of the fastest motion from sample to sample: no impact looks like that


def spikes(values: np.ndarray) -> np.ndarray:
    """Which samples of a place are far from the median of themselves and their neighbours: farther
    than noise, and farther than the fastest motion in the record gets in three samples.

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
