"""Averaging of records with more samples than a fit needs."""

import numpy as np

MOST = 10_000
"""Most samples to fit individually; neighbours in a longer record are averaged."""
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


def blurs(values: np.ndarray, size: int) -> bool:
    """True if the motion changes within groups by so much that averages would hide it."""
    means = averaged(values, np.isfinite(values), size)[0]
    return float(np.sqrt(np.mean(np.diff(means) ** 2))) > _BLUR * float(np.nanstd(values))
