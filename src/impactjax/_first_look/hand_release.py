"""When a hand lets go of what it holds at the start of a record."""

import numpy as np

from impactjax._first_look.coordinate_from_record import fall, motion
from impactjax._first_look.first_estimates import FirstEstimates, noise_size
from impactjax._first_look.savitzky_golay import savitzky_golay, weights
from impactjax._model.bouncing_ball import BouncingBall
from impactjax._model.linear_oscillator import LinearOscillator
from impactjax._model.pendulum import Pendulum
from impactjax._record.recording import AnyRecording, ImpactTimes, Recording
from impactjax._sensor.quantity import ProperAcceleration

_LEAST = 48  # samples, below which nothing is looked for
_CLEAR = 0.15  # of the greatest height: farther from the stop no contact disturbs
_HELD, _FREE = 8.0, 3.0  # unexplained accelerations, in their usual size
_SHARE = 0.5  # of the record that a hand may take at most
_INEXACT = 0.03  # of gravity: drag, and a scale that is a little wrong


def release(recording: AnyRecording, seen: FirstEstimates) -> tuple[float, float] | None:
    """From where to where [s] a record obeys the equation of free motion, after a hand let go.

    A swing's acceleration is regressed on the terms of that equation, robustly, so that a hand that
    holds or pushes at first does not matter; between impacts it is compared with the equation that
    later flights obey. `None` if the record is free from its start, as far as can be seen, or of
    another kind. An accelerometer shows the fall itself and is used up to the landing. A swing is
    taken to be free from its first turn after that, since a hand goes away gradually.
    """
    if isinstance(recording, Recording) and isinstance(recording.quantity, ProperAcceleration):
        return fall(recording)
    half = _half_period(recording, seen)
    if half is None or not isinstance(recording, Recording):
        return None
    ts = np.asarray(recording.ts)
    ts = np.linspace(ts[0], ts[-1], ts.size)
    interval = float(ts[1] - ts[0])
    width = max(int(half / 5 / interval), 7) | 1
    longer = max(int(half / 4 / interval), 3) | 1
    if len(ts) < max(_LEAST, 6 * width):
        return None
    values = np.interp(ts, *motion(recording, seen.oscillator))
    place, rate, acceleration = _derivatives(values, width, interval)
    margin = (width + longer) // 2
    known = np.interp(ts, recording.ts, recording.valid) == 1
    clear, later = _clear(values, known, seen, width, margin)
    enough = np.count_nonzero(clear & later) >= _LEAST
    if not (enough or isinstance(seen.oscillator, BouncingBall)):
        return None
    if seen.swings_freely:
        left = _left(acceleration, _terms(seen, place, rate), clear)
    else:
        left = acceleration - _free_acceleration(seen, place)
    unexplained = np.abs(_middle(left, longer))
    if enough:
        usual = float(np.median(unexplained[clear & later])) / 0.6745
    else:
        usual = _expected(seen, noise_size(values), width, interval)
    begin = _let_go(unexplained, usual, clear, longer, margin)
    if begin is None or begin > _SHARE * len(ts):
        return None
    begin += margin // 2
    if seen.swings_freely:
        turns = np.flatnonzero(np.diff(np.sign(rate[begin:])) != 0)
        begin += int(turns[0]) if turns.size else 0
    return float(ts[begin]), float(ts[-1])


def _derivatives(
    values: np.ndarray, width: int, interval: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smoothed values, their rate and acceleration."""
    place, rate, acceleration = (
        savitzky_golay(values, width, 3, order, interval) for order in (0, 1, 2)
    )
    return place, rate, acceleration


def _clear(
    values: np.ndarray, known: np.ndarray, seen: FirstEstimates, width: int, margin: int
) -> tuple[np.ndarray, np.ndarray]:
    """Where no stop, no gap and no end of the record disturbs, and what comes after the first
    impact.
    """
    from scipy import ndimage

    near, later = np.zeros(len(values), bool), np.ones(len(values), bool)
    if not seen.swings_freely:
        near = values - values.min() < _CLEAR * np.ptp(values)
        later = np.cumsum(near) > 0
    clear = np.asarray(ndimage.minimum_filter1d(known & ~near, 2 * width + 1), bool)
    clear[:margin] = clear[len(values) - margin :] = False
    return clear, later


def _middle(values: np.ndarray, width: int) -> np.ndarray:
    from scipy import ndimage

    return np.asarray(ndimage.median_filter(values, width))


def _expected(seen: FirstEstimates, noise: float, width: int, interval: float) -> float:
    """Size of the unexplained acceleration of a ball in flight that is due to noise, or to little
    that was left out.
    """
    shares = weights(width, 3, 2, interval)
    inexact = _INEXACT * abs(float(_free_acceleration(seen, np.zeros(1))[0]))
    return max(noise * float(np.linalg.norm(shares)), inexact)


def _let_go(
    unexplained: np.ndarray, usual: float, clear: np.ndarray, longer: int, first: int
) -> int | None:
    """The first sample of a calm stretch after a beginning that is not; `None` if there is none."""
    from scipy import ndimage

    if not clear[first] or not unexplained[first] > _HELD * usual:
        return None
    strange = unexplained > _FREE * usual
    calm = ndimage.minimum_filter1d((~strange).astype(int), longer, origin=-(longer // 2)) > 0
    free = np.flatnonzero((calm & clear)[first:])
    return first + int(free[0]) if free.size else None


def _half_period(recording: AnyRecording, seen: FirstEstimates) -> float | None:
    """About the time between two turns [s]; `None` where there is no equation to compare with."""
    if isinstance(recording, ImpactTimes):
        return None
    oscillator = seen.oscillator
    if isinstance(oscillator, Pendulum | LinearOscillator):
        return np.pi / float(oscillator.omega_n)
    if isinstance(oscillator, BouncingBall):
        height = float(np.max(motion(recording, oscillator)[1]))
        return 2 * np.sqrt(2 * max(height, 0.0) / float(oscillator.gravity)) or None
    return None


def _free_acceleration(seen: FirstEstimates, place: np.ndarray) -> np.ndarray:
    """The acceleration in flight, friction left out."""
    if isinstance(seen.oscillator, BouncingBall):
        return np.full_like(place, -float(seen.oscillator.gravity))
    omega = (
        float(seen.oscillator.omega_n)
        if isinstance(seen.oscillator, Pendulum | LinearOscillator)
        else 0.0
    )
    return -(omega**2) * _restoring(seen, place)


def _terms(seen: FirstEstimates, place: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """What the acceleration of a swing is a sum of; a constant takes up an offset."""
    return np.stack([_restoring(seen, place), rate, np.sign(rate), np.ones_like(place)], axis=1)


def _restoring(seen: FirstEstimates, place: np.ndarray) -> np.ndarray:
    return np.sin(place) if isinstance(seen.oscillator, Pendulum) else place


def _left(values: np.ndarray, terms: np.ndarray, used: np.ndarray) -> np.ndarray:
    """What a regression leaves, everywhere, that leaves out what does not belong.

    It starts from the later part of what is used, where no hand is, and lets in what agrees.
    """
    agrees = used & (np.cumsum(used) > _SHARE * np.count_nonzero(used))
    left = values
    for _ in range(10):
        factors, *_ = np.linalg.lstsq(terms[agrees], values[agrees])
        left = values - terms @ factors
        usual = np.median(np.abs(left[agrees])) / 0.6745
        agrees = used & (np.abs(left) <= _FREE * usual)
    return left
