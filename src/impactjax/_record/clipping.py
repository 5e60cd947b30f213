"""Samples at the end of an instrument's range."""

import numpy as np

_NEAR = 0.02  # of the level
_SHORTEST = 3  # samples in a row
_OVERSHOOT = 3.0  # of the motion beyond the level, in the record's smallest steps


def clipped(values: np.ndarray, level: float | None) -> np.ndarray:
    """Which samples show the instrument's limit instead of the quantity.

    With a known level those within 2 % of it and beyond, on either side: an instrument's range is
    a round number, and it is no longer linear just below. Otherwise those at the record's extreme,
    if the slopes on both sides of a run of equal samples there say that the motion went on: a turn
    that an encoder's steps made flat goes on by less than a step.
    """
    if level is not None:
        return np.abs(values) >= (1 - _NEAR) * level
    found = np.zeros(len(values), bool)
    for sign in (1.0, -1.0):
        found |= _beyond(sign * values)
    return found


def _beyond(values: np.ndarray) -> np.ndarray:
    """All that is at the maximum, if a run there hides more than a step."""
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
