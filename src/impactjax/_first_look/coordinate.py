"""The coordinate behind a record of any quantity, roughly: enough to start a search from."""

from itertools import pairwise

import numpy as np

from impactjax._first_look.peaks import peaks

_PULSE = 0.2  # of the greatest value: a contact
_PEAKED = 4.0  # how much farther a record with contacts goes to one side than to the other


def pulses(values: np.ndarray) -> list[tuple[int, int]]:
    """The first sample of each pulse, and the first one after it."""
    pushed = np.concatenate([[False], values > _PULSE * values.max(), [False]])
    edges = np.flatnonzero(np.diff(pushed.astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def is_peaked(values: np.ndarray) -> bool:
    """Whether a record goes much farther up than down, as the push of a stop does."""
    middle = float(np.median(values))
    return float(values.max()) - middle > _PEAKED * (middle - float(values.min()))


def _integral(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.diff(ts) * (values[1:] + values[:-1]) / 2)])


def from_velocity(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Place by integration: above the lowest points if it leaves them suddenly, else about zero."""
    place = _integral(ts, values)
    jumps = np.diff(values)
    if not is_peaked(jumps):
        return place - np.mean(place)
    impacts = peaks(-place, 0.02 * float(np.ptp(place)))
    if not impacts.size:
        return place - place.min()
    return place - np.interp(ts, ts[impacts], place[impacts])


def from_swing(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Place in a swing, opposite to its acceleration."""
    level = values - np.mean(values)
    crossings = ts[:-1][np.diff(np.sign(level)) != 0]
    half = float(np.median(np.diff(crossings))) if crossings.size > 1 else float(ts[-1] - ts[0])
    return -level * (half / np.pi) ** 2


def from_pulses(ts: np.ndarray, values: np.ndarray, weight: float | None) -> np.ndarray:
    """Parabolas between the pulses of an acceleration: under a constant weight [m/s²], or with the
    pulses' impulse.
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
