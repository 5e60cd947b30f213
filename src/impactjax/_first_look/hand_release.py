"""Detection of a hand that holds the mass at the start of a record, and of its release."""

import numpy as np

from impactjax._first_look.first_look import FirstLook, noise_size
from impactjax._first_look.savitzky_golay import savitzky_golay, weights
from impactjax._model.gravity import STANDARD_GRAVITY

_LEAST = 48  # least number of samples
_CLEAR = 0.15  # height, relative to the greatest, above which no contact disturbs
_HELD, _FREE = 8.0, 3.0  # residual acceleration with and without a hand, in usual residuals
_SHARE = 0.5  # largest share of the record with a hand
_INEXACT = 0.03  # allowed error of the acceleration, relative to gravity: drag, wrong scale
_BRIDGED = 4  # missing samples in a row between which the place is as good as known
_FALLS = 0.5  # proper acceleration, relative to gravity, below which the mass falls freely


def fall(ts: np.ndarray, values: np.ndarray, valid: np.ndarray) -> tuple[float, float] | None:
    """Begin and end [s] of the free fall and the landing of an accelerometer that was held first.

    `None` if it falls from the start. The motion after the landing is left out, since the body may
    tumble.
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
    """Begin and end [s] of the free motion of a coordinate, after a hand let go.

    The residual acceleration is that which the equation of free motion does not explain. For a free
    swing it comes from a regression of the acceleration on the terms of the equation, trimmed so
    that samples with a hand do not matter; for flights between impacts from the equation itself.
    The motion is free when the residual falls to its usual size; a swing from its first turn after
    that, since a hand lets go gradually. `None` if the record is free from its start, as far as can
    be detected, or if its equation is not known.
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
    values, known = np.interp(even, ts, places), np.interp(even, ts, _bridged(valid)) == 1
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


def _bridged(valid: np.ndarray) -> np.ndarray:
    """The mask of valid samples, with short gaps closed."""
    from scipy import ndimage

    return valid | np.asarray(ndimage.binary_closing(valid, np.ones(_BRIDGED + 1, bool)))


def _derivatives(
    values: np.ndarray, width: int, interval: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smoothed values, and their first and second time derivatives."""
    place, rate, acceleration = (
        savitzky_golay(values, width, 3, order, interval) for order in (0, 1, 2)
    )
    return place, rate, acceleration


def _clear(
    values: np.ndarray, known: np.ndarray, look: FirstLook, width: int, margin: int
) -> tuple[np.ndarray, np.ndarray]:
    """Two masks: samples clear of stops, gaps and record ends; samples after the first impact."""
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
    """Expected residual acceleration of a ball in flight, from noise and small model errors."""
    shares = weights(width, 3, 2, interval)
    inexact = _INEXACT * abs(float(look.oscillator.free_acceleration(np.zeros(1))[0]))
    return max(noise * float(np.linalg.norm(shares)), inexact)


def _let_go(
    unexplained: np.ndarray, usual: float, clear: np.ndarray, longer: int, first: int
) -> int | None:
    """The first sample of free motion, if the record begins with a hand; else `None`."""
    from scipy import ndimage

    if not clear[first] or not unexplained[first] > _HELD * usual:
        return None
    strange = unexplained > _FREE * usual
    calm = ndimage.minimum_filter1d((~strange).astype(int), longer, origin=-(longer // 2)) > 0
    free = np.flatnonzero((calm & clear)[first:])
    return first + int(free[0]) if free.size else None


def _terms(look: FirstLook, place: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Regressors of the acceleration of a swing: restoring force, viscous and dry friction, and a
    constant for an offset.
    """
    restoring = look.oscillator.restoring(place)
    return np.stack([restoring, rate, np.sign(rate), np.ones_like(place)], axis=1)


def _left(values: np.ndarray, terms: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Residuals, at all samples, of an outlier-trimmed regression.

    It starts from the later half of the used samples, which are free of a hand, and then repeatedly
    adds the samples that agree with it.
    """
    agrees = used & (np.cumsum(used) > _SHARE * np.count_nonzero(used))
    left = values
    for _ in range(10):
        factors, *_ = np.linalg.lstsq(terms[agrees], values[agrees])
        left = values - terms @ factors
        usual = np.median(np.abs(left[agrees])) / 0.6745
        agrees = used & (np.abs(left) <= _FREE * usual)
    return left
