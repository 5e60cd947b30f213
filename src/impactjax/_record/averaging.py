"""Averaging of records with more samples than a fit needs."""

import numpy as np

MOST = 40_000
"""Most samples to fit individually; neighbours in a longer record are averaged."""
_BEND = 0.5  # error of a mean by the bend of the motion, relative to its noise, that is too large
_EXACT = 1e-5  # noise of a record that shows none, relative to its standard deviation
_BLUR = 0.2  # largest change within a group, relative to the standard deviation of the record


def group_size(count: int) -> int:
    """Number of neighbours to average to one, in a record of `count` samples."""
    return -(-count // MOST)


def averaged(values: np.ndarray, valid: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of the valid values in groups of neighbours, and a mask of the groups with any."""
    groups = len(values) // size
    kept = valid[: groups * size].reshape(groups, size)
    numbers = np.where(valid, values, 0.0)[: groups * size].reshape(groups, size)
    count = kept.sum(axis=1)
    return numbers.sum(axis=1) / np.maximum(count, 1), count > 0


def bent(means: np.ndarray, size: int, noise: float) -> np.ndarray:
    """Mask of the means of groups within which the motion bends too much, as it does in a contact.

    The mean of n samples at intervals h differs by q″ h² (n² − 1)/24 from the place in the middle;
    second differences of means are q″ (n h)².
    """
    errors = np.abs(np.diff(means, 2)) * (1 - size**-2.0) / 24
    most = _BEND * max(noise / np.sqrt(size), _EXACT * float(np.std(means)))
    return np.pad(errors > most, 1)


def blurs(values: np.ndarray, size: int) -> bool:
    """True if the motion changes within groups by so much that averages would hide it."""
    means = averaged(values, np.isfinite(values), size)[0]
    return float(np.sqrt(np.mean(np.diff(means) ** 2))) > _BLUR * float(np.nanstd(values))
