"""Outliers: samples that jump away from the motion and back."""

import numpy as np

from impactjax._first_look.first_look import noise_size
from impactjax._sensor.abstract_quantity import AbstractQuantity

_WINDOW = 5  # samples of the running median; up to two in a row may be wrong
_BESIDE = 11  # samples around one that tell how fast the motion is there
_NOISE = 8.0  # least distance from the running median, in standard deviations of the noise
_STEPS = 3.0  # least distance, in the largest change of the running median from sample to sample
_UNITS = 2.0  # distance that is none, in steps of the recorded values


def outliers(values: np.ndarray, valid: np.ndarray, quantity: AbstractQuantity) -> np.ndarray:
    """Mask of the valid samples that are outliers. Those of a place or a velocity are found; pulses
    of other quantities look the same.
    """
    wrong = np.zeros(len(valid), bool)
    if quantity.derivative in (0, 1):
        wrong[valid] = spikes(values[valid])
    return wrong


def spikes(values: np.ndarray) -> np.ndarray:
    """Mask of the samples that are far from the running median: farther than noise, and farther
    than the motion beside them moves in three samples.

    Source: Hampel's identifier, with a bound for motion: Pearson, IEEE Transactions on Control
    Systems Technology 10, 55 (2002).
    """
    if len(values) < 3 * _WINDOW:
        return np.zeros(len(values), bool)
    from scipy import ndimage

    middle = ndimage.median_filter(values, _WINDOW, mode="mirror")
    moves = np.abs(np.diff(middle, prepend=middle[0]))
    fastest = ndimage.maximum_filter(moves, _BESIDE, mode="mirror")
    steps = np.abs(np.diff(values))
    step = float(np.min(steps[steps > 0], initial=np.inf))
    least = max(_NOISE * noise_size(values), _UNITS * step)
    return np.abs(values - middle) > np.maximum(least, _STEPS * fastest)
