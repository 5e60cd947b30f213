"""The motion behind a record of any quantity, roughly: enough to start a search from."""

from itertools import pairwise

import numpy as np

from impactjax._first_look.peaks import peaks
from impactjax._model.bouncing_ball import BouncingBall
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._model.oscillator import AbstractOscillator
from impactjax._record.recording import Recording
from impactjax._sensor.quantity import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularVelocity,
    ContactForce,
    Displacement,
    ProperAcceleration,
    Velocity,
)

_PULSE = 0.2  # of the greatest value: a contact
_PEAKED = 4.0  # how much farther a record with contacts goes to one side than to the other
_FALLS = 0.5  # of gravity: less is felt in free fall


def motion(recording: Recording, oscillator: AbstractOscillator) -> tuple[np.ndarray, np.ndarray]:
    """Times and coordinates behind a recording, gaps filled by straight lines.

    A velocity is integrated; contacts are seen as pulses of acceleration or force, and a parabola
    is laid between them.
    """
    quantity, (ts, values) = recording.quantity, _without_gaps(recording)
    if isinstance(quantity, Angle | Displacement):
        return ts, values
    if isinstance(quantity, Velocity | AngularVelocity):
        return ts, _from_velocity(ts, values)
    if isinstance(quantity, ContactForce):
        values = values / float(oscillator.mass * oscillator.lever())
    if not _shows_contacts(recording, values):
        return ts, _swing(ts, values)
    return ts, _from_pulses(ts, values, oscillator)


def contact_duration(recording: Recording) -> float | None:
    """Duration of a contact [s] where a recording shows contacts as pulses: that of half a sine as
    wide as these are at half their heights.
    """
    ts, values = _without_gaps(recording)
    pulses = [values[begin:end] for begin, end in _pulses(values)]
    if not (pulses and _shows_contacts(recording, values)):
        return None
    samples = np.median([np.count_nonzero(pulse > pulse.max() / 2) for pulse in pulses])
    return 1.5 * float(samples * np.median(np.diff(ts)))


def fall(recording: Recording) -> tuple[float, float] | None:
    """From where to where an accelerometer that was held first shows a free fall and the landing;
    `None` if it falls from the start. What follows a landing is left out: who knows how it tumbles.
    """
    ts, values = np.asarray(recording.ts), np.abs(np.asarray(recording.values))
    falls = (values < _FALLS * STANDARD_GRAVITY) & np.asarray(recording.valid)
    hit = int(np.argmax(values))
    before = np.flatnonzero(falls[:hit])
    if not before.size:
        return None
    touch = int(before[-1])
    held = np.flatnonzero(~falls[:touch])
    if not held.size:
        return None
    after = np.flatnonzero(falls[hit:])
    left = hit + int(after[0]) if after.size else len(ts) - 1
    return float(ts[held[-1] + 1]), float(min(2 * ts[left] - ts[touch], ts[-1]))


def _without_gaps(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    ts, valid = np.asarray(recording.ts), np.asarray(recording.valid)
    return ts, np.interp(ts, ts[valid], np.asarray(recording.values)[valid])


def _shows_contacts(recording: Recording, values: np.ndarray) -> bool:
    """Whether contacts are pulses of a recording."""
    if isinstance(recording.quantity, Acceleration | AngularAcceleration):
        return _is_peaked(values)
    return isinstance(recording.quantity, ProperAcceleration | ContactForce)


def _pulses(values: np.ndarray) -> list[tuple[int, int]]:
    """The first sample of each pulse, and the first one after it."""
    pushed = np.concatenate([[False], values > _PULSE * values.max(), [False]])
    edges = np.flatnonzero(np.diff(pushed.astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _is_peaked(values: np.ndarray) -> bool:
    """Whether a record goes much farther up than down, as the push of a stop does."""
    middle = float(np.median(values))
    return float(values.max()) - middle > _PEAKED * (middle - float(values.min()))


def _integral(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.diff(ts) * (values[1:] + values[:-1]) / 2)])


def _from_velocity(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Place by integration: above the lowest points if it leaves them suddenly, else about zero."""
    place = _integral(ts, values)
    jumps = np.diff(values)
    if not _is_peaked(jumps):
        return place - np.mean(place)
    impacts = peaks(-place, 0.02 * float(np.ptp(place)))
    if not impacts.size:
        return place - place.min()
    return place - np.interp(ts, ts[impacts], place[impacts])


def _swing(ts: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Place of a swing, opposite to its acceleration."""
    level = values - np.mean(values)
    crossings = ts[:-1][np.diff(np.sign(level)) != 0]
    half = float(np.median(np.diff(crossings))) if crossings.size > 1 else float(ts[-1] - ts[0])
    return -level * (half / np.pi) ** 2


def _from_pulses(ts: np.ndarray, values: np.ndarray, oscillator: AbstractOscillator) -> np.ndarray:
    """Parabolas between the pulses: of a ball under its gravity, else with the pulses' impulse."""
    pulses = [(begin, min(end, len(ts) - 1)) for begin, end in _pulses(values)]
    gravity = float(oscillator.gravity) if isinstance(oscillator, BouncingBall) else None
    place = np.zeros(len(ts))
    impulse = _integral(ts, np.maximum(values, 0))
    if pulses and pulses[0][0] > 0:
        hit, after = pulses[0]
        fall = ts[hit] - ts[0]
        deceleration = gravity or (impulse[after] - impulse[hit]) / (2 * fall)
        place[:hit] = deceleration / 2 * (fall**2 - (ts[:hit] - ts[0]) ** 2)
    for (_, end), (begin, after) in pairwise(pulses):
        flight = ts[begin] - ts[end]
        speed = gravity * flight / 2 if gravity else (impulse[after] - impulse[begin]) / 2
        s = ts[end:begin] - ts[end]
        place[end:begin] = speed * s * (1 - s / flight)
    return place
