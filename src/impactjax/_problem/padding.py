"""Few sizes for recordings of any length, so that they share compiled programs."""

import math


def padded_size(count: int) -> int:
    """The smallest of the numbers 8, 12, 16, 24, 32, ... that is at least `count`."""
    power = 8 << max(math.ceil(math.log2(count / 8)), 0)
    return power * 3 // 4 if count <= power * 3 // 4 and power > 8 else power
