"""First look at a blow: one impact of a free mass, such as a hammer, recorded by its force alone.

The force does not tell the speed of the approach v, only the impulse m v (1 + r). A search starts
from a usual restitution r.
"""

from itertools import pairwise

import numpy as np

from impactjax._first_look.coordinate import pulses
from impactjax._first_look.first_look import USUAL_RESTITUTION, FirstLook
from impactjax._model.initial_state import InitialState
from impactjax._model.oscillator import AbstractOscillator

_RINGS = 3.0  # widths of a pulse within which others are those of a ringing instrument
_ZERO = 10  # percentile of a record that is about its zero, since a blow is short and pushes only
_MOST, _FLAT = (5, 95), 0.1  # percentiles of a flat record, and their distance over the maximum
_RISE = 0.064  # time from the begin of half a sine wave to a fifth of its maximum, in its durations
_HALF = 1.5  # duration of half a sine wave, in its widths at half of the maximum
_BEFORE, _AFTER = 1.0, 8.0  # widths of the pulse that are fitted before and after it

Pulse = tuple[int, int]  # first sample, and first one after it


def blow(values: np.ndarray) -> Pulse | None:
    """First sample of the pulse of a single blow, and first one after it; `None` if there are more
    blows, or none, or if the record is not flat beside it.
    """
    values = _from_zero(values)
    found = pulses(values)
    if not values.max() > 0:
        return None
    widest = max(end - begin for begin, end in found)
    if any(begin - end > _RINGS * widest for (_, end), (begin, _) in pairwise(found)):
        return None
    begin, end = max(found, key=lambda pulse: float(values[pulse[0] : pulse[1]].sum()))
    at = np.arange(len(values))
    beside = values[(at < begin - widest) | (at > end + _RINGS * widest)]
    flat = not beside.size or np.ptp(np.percentile(beside, _MOST)) < _FLAT * values.max()
    return (begin, end) if flat else None


def look_at_blow(
    ts: np.ndarray, accelerations: np.ndarray, pulse: Pulse, oscillator: AbstractOscillator
) -> FirstLook:
    """First look at a blow.

    **Arguments:**

    - `ts`, `accelerations`: times [s], and accelerations by the stop [m/s²].
    - `pulse`: samples of the contact.
    - `oscillator`: mass that was recorded.
    """
    begin, end = pulse
    pushed = _from_zero(accelerations)[begin:end]
    interval = float(np.median(np.diff(ts)))
    duration = _HALF * interval * np.count_nonzero(pushed > pushed.max() / 2)
    touch = float(ts[begin]) - _RISE * duration
    speed = interval * float(pushed.sum()) / (1 + USUAL_RESTITUTION)
    return FirstLook(
        oscillator,
        InitialState(speed * (touch - float(ts[0])), -speed),
        np.array([speed]),
        np.array([np.nan]),
        np.pi / duration,
        False,
        np.array([touch]),
        is_blow=True,
    )


def _from_zero(values: np.ndarray) -> np.ndarray:
    return values - np.percentile(values, _ZERO)


def surroundings(ts: np.ndarray, pulse: Pulse) -> tuple[float, float] | None:
    """Begin and end [s] of a blow with what surrounds it; `None` if the record is no longer."""
    begin, end = float(ts[pulse[0]]), float(ts[min(pulse[1], len(ts) - 1)])
    width = end - begin
    first, last = begin - _BEFORE * width, end + _AFTER * width
    if first <= ts[0] and last >= ts[-1]:
        return None
    return max(first, float(ts[0])), min(last, float(ts[-1]))
