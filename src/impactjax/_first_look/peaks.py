"""Local maxima of a record by their prominence."""

from collections.abc import Iterable, Iterator

import numpy as np


def peaks(values: np.ndarray, prominence: float) -> np.ndarray:
    """Indices of the local maxima with at least some prominence: on both sides the record falls by
    that much before it gets higher or ends. A plateau counts once, in its middle.
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
    """Height of each top above the lowest valley since the last higher top.

    The stack `higher` holds the tops that are higher than all later ones, each with the lowest
    valley before it. A new top removes the lower ones from the stack.

    **Arguments:**

    - `heights`: heights of the tops, in order.
    - `valleys`: for each top, the lowest value between the previous top and it.
    """
    higher: list[tuple[float, float]] = []
    for height, valley in zip(heights, valleys, strict=True):
        lowest = valley
        while higher and higher[-1][0] <= height:
            lowest = min(lowest, higher.pop()[1])
        higher.append((height, lowest))
        yield height - lowest
