"""Local maxima of a record by how far they stand out."""

from collections.abc import Iterable, Iterator

import numpy as np


def peaks(values: np.ndarray, prominence: float) -> np.ndarray:
    """Where a record has local maxima from which it falls by at least `prominence` on both sides
    before it gets higher or ends. A level one counts in its middle.
    """
    changes = np.flatnonzero(np.diff(values))
    rises = values[changes + 1] > values[changes]
    turns = np.flatnonzero(rises[:-1] & ~rises[1:])
    tops = (changes[turns] + 1 + changes[turns + 1]) // 2
    if not tops.size:
        return tops
    heights, valleys = values[tops], np.minimum.reduceat(values, [0, *tops])
    before = np.array(list(_falls(heights, valleys[:-1])))
    after = np.array(list(_falls(heights[::-1], valleys[:0:-1])))[::-1]
    return tops[np.minimum(before, after) >= prominence]


def _falls(heights: Iterable[float], valleys: Iterable[float]) -> Iterator[float]:
    """How far each top is above the lowest valley since a higher one; a valley is before its top.

    Tops that are not higher than a later one, and their valleys, are behind that for good.
    """
    higher: list[tuple[float, float]] = []
    for height, valley in zip(heights, valleys, strict=True):
        lowest = valley
        while higher and higher[-1][0] <= height:
            lowest = min(lowest, higher.pop()[1])
        higher.append((height, lowest))
        yield height - lowest
