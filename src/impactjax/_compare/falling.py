"""Flights of a recorded height or velocity that are those of a falling mass."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from impactjax._first_look.first_look import FirstLook
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.recording import Recording

OFF = 0.05  # relative difference of gravity from its known value that is a fault
_FEWEST = 2  # flights
_SEVERAL, _SHRINKS = 3, 1.3  # flights, and ratio of the longest to the shortest, of other falls
_SAMPLES = 8  # of the middle of a flight

Accelerations = Float[np.ndarray, " flights"]


def are_of_gravity(accelerations: Accelerations) -> bool:
    """True if several flights have the acceleration of gravity."""
    near = np.abs(accelerations / STANDARD_GRAVITY - 1) < OFF
    return near.size >= _FEWEST and bool(np.all(near))


def are_of_a_fall(accelerations: Accelerations, look: FirstLook) -> bool:
    """True if several flights of different length have one acceleration, less than that of gravity,
    as on an incline. Those of an oscillator whose equilibrium is at the stop have one length; a
    spring that presses it to the stop may give them one acceleration, also a larger one.
    """
    flights = np.diff(look.marks)
    flights = flights[flights > np.max(flights, initial=0.0) / 2]
    if accelerations.size < _SEVERAL or np.max(flights) < _SHRINKS * np.min(flights):
        return False
    usual = float(np.median(accelerations))
    return 0 < usual < STANDARD_GRAVITY and bool(np.all(np.abs(accelerations / usual - 1) < OFF))


def gravities(recording: AbstractRecording, look: FirstLook) -> Accelerations:
    """Downward accelerations [m/s²] in the flights of a recorded height, from parabolas over their
    middle, or of a velocity, from straight lines. Flights half as long as the longest, or shorter,
    are left out; other records have none.
    """
    if not isinstance(recording, Recording) or recording.quantity.of_angle:
        return np.zeros(0)
    derivative = recording.quantity.derivative
    if derivative not in (0, 1):
        return np.zeros(0)
    order = 2 - derivative
    ts, values, found = np.asarray(recording.ts), np.asarray(recording.values), []
    least = np.max(np.diff(look.marks), initial=0.0) / 2
    for begin, end in pairwise(look.marks.tolist()):
        if end - begin <= least:
            continue
        margin = (end - begin) / 8
        inside = (ts > begin + margin) & (ts < end - margin) & np.asarray(recording.valid)
        if np.count_nonzero(inside) >= _SAMPLES:
            course = np.polynomial.Polynomial.fit(ts[inside], values[inside], order)
            found.append(-float(course.deriv(order)(0.0)))
    return np.array(found)
