"""Rough reconstruction of the coordinate from a record of another quantity, for a first look."""

from itertools import pairwise

import numpy as np

from impactjax._first_look.peaks import peaks

_PULSE = 0.2  # share of the greatest value above which a sample belongs to a pulse
_ALONE = 5  # samples of the running median
_PEAKED = 4.0  # ratio of the extremes on both sides of the median above which a record is peaked


def pulses(values: np.ndarray) -> list[tuple[int, int]]:
    """Index pairs of the pulses: first sample of each, and first sample after it."""
    pushed = np.concatenate([[False], values > _PULSE * values.max(), [False]])
    edges = np.flatnonzero(np.diff(pushed.astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def pulse_duration(
    ts: np.ndarray, values: np.ndarray, contacts: list[tuple[int, int]]
) -> float | None:
    """Duration of the contacts [s] that appear as pulses, `None` if there are none: that of half a
    sine wave with the pulses' width at half maximum.
    """
    parts = [values[begin:end] for begin, end in contacts]
    if not parts:
        return None
    samples = np.median([np.count_nonzero(pulse > pulse.max() / 2) for pulse in parts])
    return 1.5 * float(samples * np.median(np.diff(ts)))


def is_peaked(values: np.ndarray) -> bool:
    """True if a record extends much farther upwards than downwards, as the force of a stop does."""
    middle = float(np.median(values))
    return float(values.max()) - middle > _PEAKED * (middle - float(values.min()))


def _integral(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.diff(ts) * (values[1:] + values[:-1]) / 2)])


def from_velocity(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Position by integration of a velocity. If the velocity jumps, the places where it jumps most
    are made equal, since its zero may be off; then the lowest points are taken as impacts and set
    to zero. Otherwise the mean is zero. Single samples that jump do not count.
    """
    from scipy import ndimage

    place = _integral(ts, values)
    jumps = np.diff(ndimage.median_filter(values, _ALONE, mode="nearest"))
    if not is_peaked(jumps):
        return place - np.mean(place)
    largest = [(begin + end) // 2 for begin, end in pulses(jumps)]
    if len(largest) > 1:
        place = place - np.polynomial.Polynomial.fit(ts[largest], place[largest], 1)(ts)
    impacts = peaks(-place, 0.02 * float(np.ptp(place)))
    if not impacts.size:
        return place - place.min()
    return place - np.interp(ts, ts[impacts], place[impacts])


def from_swing(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Position in a free swing from its acceleration: −a (T/2π)², with the record's period T."""
    level = values - np.mean(values)
    crossings = ts[:-1][np.diff(np.sign(level)) != 0]
    half = float(np.median(np.diff(crossings))) if crossings.size > 1 else float(ts[-1] - ts[0])
    return -level * (half / np.pi) ** 2


def from_pulses(ts: np.ndarray, values: np.ndarray, weight: float | None) -> np.ndarray:
    """Position between the pulses of an acceleration, as parabolas: with a known constant weight
    [m/s²], or with speeds from the impulses of the pulses.
    """
    contacts = [(begin, min(end, len(ts) - 1)) for begin, end in pulses(values)]
    place = np.zeros(len(ts))
    impulse = _integral(ts, np.maximum(values, 0))
    if contacts and contacts[0][0] > 0:
        hit, after = contacts[0]
        fall = ts[hit] - ts[0]
        deceleration = weight or (impulse[after] - impulse[hit]) / (2 * fall)
        place[:hit] = deceleration / 2 * (fall**2 - (ts[:hit] - ts[0]) ** 2)
    for (_, end), (begin, after) in pairwise(contacts):
        flight = ts[begin] - ts[end]
        speed = weight * flight / 2 if weight else (impulse[after] - impulse[begin]) / 2
        s = ts[end:begin] - ts[end]
        place[end:begin] = speed * s * (1 - s / flight)
    return place
