"""The moment when a hand lets go of what it holds at the start of a record."""

import numpy as np

from impactjax._first_look.first_look import FirstLook, noise_size
from impactjax._first_look.savitzky_golay import savitzky_golay, weights
from impactjax._model.gravity import STANDARD_GRAVITY

_LEAST = 48  # samples, below which nothing is looked for
_CLEAR = 0.15  # of the greatest height: farther from the stop no contact disturbs
_HELD, _FREE = 8.0, 3.0  # unexplained accelerations, in their usual size
_SHARE = 0.5  # of the record that a hand may take at most
_INEXACT = 0.03  # of gravity: drag, and a scale that is a little wrong
_FALLS = 0.5  # of gravity: less is felt in free fall


def fall(ts: np.ndarray, values: np.ndarray, valid: np.ndarray) -> tuple[float, float] | None:
    """From when to when [s] an accelerometer that was held first shows a free fall and the landing.

    `None` if it falls from the start. What follows a landing is left out: how the thing tumbles is
    not known.
    """
    values = np.abs(values)
    falls = (values < _FALLS * STANDARD_GRAVITY) & valid
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


def release(
    ts: np.ndarray, places: np.ndarray, valid: np.ndarray, look: FirstLook
) -> tuple[float, float] | None:
    """From when to when [s] a coordinate obeys the equation of free motion, after a hand let go.

    The acceleration of a swing is regressed on the terms of that equation, robustly, so that a hand
    that holds or pushes at first does not matter. Between impacts it is compared with the equation
    that later flights obey. `None` if the record is free from its start, as far as can be seen, or
    if nothing is known of its equation. A swing counts as free from its first turn after that,
    since a hand goes away gradually.
    """
    half = look.oscillator.half_period(float(places.max()))
    if half is None:
        return None
    even = np.linspace(ts[0], ts[-1], ts.size)
    interval = float(even[1] - even[0])
    width = max(int(half / 5 / interval), 7) | 1
    longer = max(int(half / 4 / interval), 3) | 1
    if len(ts) < max(_LEAST, 6 * width):
        return None
    values, known = np.interp(even, ts, places), np.interp(even, ts, valid) == 1
    place, rate, acceleration = _derivatives(values, width, interval)
    margin = (width + longer) // 2
    clear, later = _clear(values, known, look, width, margin)
    enough = np.count_nonzero(clear & later) >= _LEAST
    if not (enough or look.oscillator.weight() is not None):
        return None
    if look.swings_freely:
        left = _left(acceleration, _terms(look, place, rate), clear)
    else:
        left = acceleration - look.oscillator.free_acceleration(place)
    unexplained = np.abs(_middle(left, longer))
    if enough:
        usual = float(np.median(unexplained[clear & later])) / 0.6745
    else:
        usual = _expected(look, noise_size(values), width, interval)
    begin = _let_go(unexplained, usual, clear, longer, margin)
    if begin is None or begin > _SHARE * len(ts):
        return None
    begin += margin // 2
    if look.swings_freely:
        turns = np.flatnonzero(np.diff(np.sign(rate[begin:])) != 0)
        begin += int(turns[0]) if turns.size else 0
    return float(even[begin]), float(even[-1])


def _derivatives(
    values: np.ndarray, width: int, interval: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smoothed values, their rate and acceleration."""
    place, rate, acceleration = (
        savitzky_golay(values, width, 3, order, interval) for order in (0, 1, 2)
    )
    return place, rate, acceleration


def _clear(
    values: np.ndarray, known: np.ndarray, look: FirstLook, width: int, margin: int
) -> tuple[np.ndarray, np.ndarray]:
    """Where no stop, no gap and no end of the record disturbs, and what comes after the first
    impact.
    """
    from scipy import ndimage

    near, later = np.zeros(len(values), bool), np.ones(len(values), bool)
    if not look.swings_freely:
        near = values - values.min() < _CLEAR * np.ptp(values)
        later = np.cumsum(near) > 0
    clear = np.asarray(ndimage.minimum_filter1d(known & ~near, 2 * width + 1), bool)
    clear[:margin] = clear[len(values) - margin :] = False
    return clear, later


def _middle(values: np.ndarray, width: int) -> np.ndarray:
    from scipy import ndimage

    return np.asarray(ndimage.median_filter(values, width))


def _expected(look: FirstLook, noise: float, width: int, interval: float) -> float:
    """Size of the unexplained acceleration of a ball in flight that is due to noise, or to little
    that was left out.
    """
    shares = weights(width, 3, 2, interval)
    inexact = _INEXACT * abs(float(look.oscillator.free_acceleration(np.zeros(1))[0]))
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


def _terms(look: FirstLook, place: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """What the acceleration of a swing is a sum of; a constant takes up an offset."""
    restoring = look.oscillator.restoring(place)
    return np.stack([restoring, rate, np.sign(rate), np.ones_like(place)], axis=1)


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
