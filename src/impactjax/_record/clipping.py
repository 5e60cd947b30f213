"""Samples at the end of an instrument's range."""

import numpy as np

_NEAR = 0.02  # relative distance to the level within which a sample is clipped
_SHORTEST = 3  # least number of consecutive samples
_OVERSHOOT = 3.0  # least hidden motion beyond the level, in the record's smallest steps


def clipped(values: np.ndarray, level: float | None) -> np.ndarray:
    """Mask of the samples that show the instrument's limit instead of the quantity.

    With a known level, these are the samples within 2 % of it or beyond, on either side: the stated
    range of an instrument is a round number, and just below it the instrument is not linear.
    Without one, these are the samples at the record's extremes, if there is a run of equal samples
    whose slopes on both sides imply that the motion continued by several of the smallest steps.
    A turn that quantisation made flat continues by less than a step.
    """
    if level is not None:
        return np.abs(values) >= (1 - _NEAR) * level
    found = np.zeros(len(values), bool)
    for sign in (1.0, -1.0):
        found |= _beyond(sign * values)
    return found


def _beyond(values: np.ndarray) -> np.ndarray:
    """Mask of the samples at the maximum, if a run of them hides several of the smallest steps."""
    found = np.zeros(len(values), bool)
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0]
    if not steps.size:
        return found
    at_top = np.concatenate([[False], values == np.nanmax(values), [False]])
    edges = np.flatnonzero(np.diff(at_top.astype(int)))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        length = end - begin
        reach = max(length // 2, 1)
        if length < _SHORTEST or begin < reach or end + reach > len(values):
            continue
        top = values[begin]
        rise, fall = top - values[begin - reach], top - values[end + reach - 1]
        if min(rise, fall) / reach * length / 4 > _OVERSHOOT * np.min(steps):
            found[:] = at_top[1:-1]
    return found
