"""Noise of samples, from the samples alone."""

from typing import NamedTuple

import numpy as np

QUARTILE = 0.6745  # median of the absolute value of a standard normal variable
_LAGS = (1, 2, 4, 8)  # samples
_GROWS, _MOVES = 1.4, 6.0  # ratios of the sizes at two lags: filtered noise, and motion
_FALLS, _THEN = 5.6, 3.0  # changes from one size to the next, times √samples, that are no chance
_FEW = 0.5  # share of different values below which they may be steps
_EXACT = 1e-3  # deviation from a multiple of the step, in steps


class Noise(NamedTuple):
    """Noise of a record.

    - `size`: standard deviation, in the SI unit of the record.
    - `memory`: number of samples after which it is independent; 1 for white noise.
    - `step`: step of the recorded values; 0 if they have none.
    - `difference_lag`: distance, in samples, of the values whose differences the record seems to
      be: 1 for neighbours, 2 for central differences; 0 if it seems to be recorded itself.
    """

    size: float
    memory: int = 1
    step: float = 0.0
    difference_lag: int = 0


def noise_of_samples(values: np.ndarray) -> Noise:
    """Noise of samples, from third differences.

    Filtered noise is small from sample to sample and grows with the distance of the samples. The
    third differences of a smooth motion grow with its cube. Noise of differences falls: that of
    neighbours by √(70/40) from one sample to two, that of central ones from two to four.
    """
    step = _step(values)
    if len(values) < 16:
        return Noise(step / np.sqrt(12), 1, step)
    sizes = [_differences(values, lag) for lag in _LAGS if 4 * lag < len(values)]
    best = 0
    for i in range(len(sizes) - 1):
        if not (sizes[i] > 0 and _GROWS < sizes[i + 1] / sizes[i] < _MOVES):
            break
        best = i + 1
    size = max(sizes[best], step / np.sqrt(12))
    return Noise(size, _LAGS[best], step, _difference_lag(sizes, len(values)))


def _difference_lag(sizes: list[float], count: int) -> int:
    """Lag of the differences whose noise has such sizes: 1 if the size falls from one sample to
    two, 2 if it first rises and then falls to four, else 0.
    """
    if len(sizes) < 3 or min(sizes) == 0:
        return 0
    first, second = sizes[0] / sizes[1], sizes[1] / sizes[2]
    excess, then = _FALLS / np.sqrt(count), _THEN / np.sqrt(count)
    if first > 1 + excess:
        return 1
    return 2 if first < 1 - excess and second > 1 + then else 0


def _differences(values: np.ndarray, lag: int) -> float:
    third = values[3 * lag :] - 3 * values[2 * lag : -lag] + 3 * values[lag : -2 * lag]
    third = third - values[: -3 * lag]
    return float(np.median(np.abs(third))) / QUARTILE / np.sqrt(20)


def _step(values: np.ndarray) -> float:
    """The step of values that are multiples of it; 0 if they are not, or hardly repeat."""
    different = np.unique(values)
    if len(different) < 3 or len(different) > _FEW * len(values):
        return 0.0
    steps = np.diff(different)
    step = float(np.median(steps[steps < 1.5 * steps.min()]))
    multiples = steps / step
    return step if np.all(np.abs(multiples - np.round(multiples)) < _EXACT * multiples) else 0.0
