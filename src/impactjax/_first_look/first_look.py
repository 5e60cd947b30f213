"""First look at a record: estimates of motion and contact before any fit, in NumPy."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from impactjax._first_look.peaks import peaks
from impactjax._first_look.savitzky_golay import savitzky_golay
from impactjax._model.initial_state import InitialState
from impactjax._model.oscillator import AbstractOscillator

_PROMINENCE = 6.0  # least prominence of an extremum, in standard deviations of the noise
_SHARP = 2.5  # ratio of the rise after a turn to the fall after a top above which it is an impact
_NEAR = 0.05  # distance to the stated stop, relative to the motion, that is not significant
USUAL_RESTITUTION = 0.6
_USUAL_SPEED = 0.5  # [m/s]
_REST = 1e-6  # [m/s], speed below which an impact does not count
_DIFFERENT = 1e-3  # least relative range of the speeds for a straight line
CONTACT_SAMPLES = 4  # guess of a contact's duration
_USUAL_DAMPING = 0.003
_RIGID = 1e3  # [rad/s], contact frequency if the record shows nothing of the contact


class FirstLook(NamedTuple):
    """Estimates of motion and contact from a record, before any fit.

    - `oscillator`: oscillator with estimated values.
    - `initial`: state at the first sample, or after the first impact of a list.
    - `speeds`, `restitutions`: approach speeds [m/s] and restitutions [1] of the detected impacts.
    - `contact_frequency`: guess of the natural frequency during contact [rad/s].
    - `swings_freely`: true if the motion passes through the position of the stop.
    - `marks`: times of the detected impacts, or of the extremes of a free swing [s].
    - `is_blow`: true for a single impact recorded by its force, which tells its impulse only.
    - `elsewhere`: coordinate of the detected impacts, if it clearly differs from that of the stop.
    - `phase`: phase of the motion of the base [rad], if it moves.
    """

    oscillator: AbstractOscillator
    initial: InitialState
    speeds: np.ndarray
    restitutions: np.ndarray
    contact_frequency: float
    swings_freely: bool
    marks: np.ndarray = np.zeros(0)
    elsewhere: float | None = None
    is_blow: bool = False
    phase: float | None = None

    @property
    def restitution(self) -> float:
        """A typical coefficient of restitution; a usual one if the record has none."""
        usable = self.usual_restitutions
        return float(np.median(usable)) if usable.size else USUAL_RESTITUTION

    @property
    def usual_restitutions(self) -> np.ndarray:
        """The coefficients of restitution between 0 and 1."""
        return self.restitutions[(self.restitutions > 0.02) & (self.restitutions < 1)]

    @property
    def speed(self) -> float:
        """A typical speed of impact [m/s]."""
        usable = self.speeds[self.speeds > _REST]
        return float(np.median(usable)) if usable.size else _USUAL_SPEED

    @property
    def restitution_line(self) -> tuple[float, float]:
        """r0 and α of a straight line through the impacts, r = r0 − α v."""
        differ = self.speeds.size > 2 and np.ptp(self.speeds) > _DIFFERENT * self.speeds.max()
        if not differ:
            return self.restitution, 0.0
        slope, level = np.polyfit(self.speeds, self.restitutions, 1)
        if not 0.02 < level < 0.98:
            return self.restitution, 0.0
        return float(level), float(-slope)

    @property
    def restitution_power(self) -> tuple[float, float]:
        """r0 and α of r = r0 v^−α through the typical impact, with the slope of the line."""
        _, slope = self.restitution_line
        r, v = self.restitution, self.speed
        alpha = float(np.clip(slope * v / r, 0.05, 1.0))
        return r * v**alpha, alpha


def look_at_motion(
    ts: np.ndarray,
    places: np.ndarray,
    oscillator: AbstractOscillator,
    gap: float,
    contact_duration: float | None,
) -> FirstLook:
    """First look at a coordinate sampled in time.

    **Arguments:**

    - `ts`, `places`: times [s] and coordinates.
    - `oscillator`: oscillator that was recorded; values that the record does not show are kept.
    - `gap`: gap of the lower stop, which stands at −gap.
    - `contact_duration`: duration of a contact [s], if it was detected.
    """
    heights = places + gap
    smooth, noise = smoothed(heights)
    initial = _initial(ts, heights, noise, gap)
    guess = CONTACT_SAMPLES * float(np.median(np.diff(ts)))
    contact = np.pi / (contact_duration or guess)
    stop = stop_seen(heights, smooth, noise)
    if smooth.min() < -0.25 * smooth.max():
        swinging, marks = _swinging(ts, smooth, noise, oscillator)
        none = np.zeros(0)
        look = FirstLook(swinging, initial, none, none, contact, True, marks)
    else:
        look = _impacting(ts, smooth, noise, oscillator, initial, contact, gap)
    return look if stop is None else look._replace(elsewhere=stop - gap)


def look_at_flights(times: np.ndarray, oscillator: AbstractOscillator) -> FirstLook:
    """First look at the times of impacts. A flight of duration T under a constant weight g has the
    speed g T / 2 at both ends, which gives the restitution of each impact.

    **Raises** `ValueError` for an oscillator without a constant weight.
    """
    weight = oscillator.weight()
    if weight is None:
        raise ValueError(
            "A list of impact times needs a bouncing ball: its flights give the speeds."
        )
    speeds = weight * np.diff(times) / 2
    initial = InitialState(0.0, speeds[0])
    ratios = speeds[1:] / speeds[:-1]
    return FirstLook(oscillator, initial, speeds[:-1], ratios, _RIGID, False, times)


def smoothed(values: np.ndarray) -> tuple[np.ndarray, float]:
    """A smoothed record, and the standard deviation of its noise."""
    if len(values) < 16:
        return values, 0.0
    return savitzky_golay(values, 9, 2), noise_size(values)


def noise_size(values: np.ndarray) -> float:
    """Standard deviation of white noise on a smooth record, from its third differences."""
    return float(np.median(np.abs(np.diff(values, 3))) / 0.6745 / np.sqrt(20))


def stop_seen(values: np.ndarray, smooth: np.ndarray, noise: float) -> float | None:
    """Position at which a record turns back sharply, if that is clearly not at zero."""
    turns = turns_of(smooth, noise)
    if len(turns) < 2:
        return None
    tops = np.array([a + int(np.argmax(smooth[a:b])) for a, b in pairwise(turns.tolist())])
    reach = max(int(np.median(np.diff(turns))) // 8, 2)
    turns, tops = (at[(at >= reach) & (at < len(smooth) - reach)] for at in (turns, tops))
    if not (turns.size and tops.size):
        return None
    rises = (smooth[turns - reach] + smooth[turns + reach]) / 2 - smooth[turns]
    falls = smooth[tops] - (smooth[tops - reach] + smooth[tops + reach]) / 2
    sharp = rises > max(_SHARP * float(np.median(falls)), _PROMINENCE * noise)
    if not sharp.any():
        return None
    lowest = [values[i - 2 : i + 3].min() for i in turns[sharp]]
    place, fastest = float(np.median(lowest)), float(np.max(np.abs(np.diff(smooth))))
    near = max(_PROMINENCE * noise, _NEAR * float(np.ptp(smooth)), 2 * fastest)
    return place if abs(place) > near else None


def turns_of(smooth: np.ndarray, noise: float) -> np.ndarray:
    """Indices of the minima of a record, between one flight or swing and the next."""
    return peaks(-smooth, max(_PROMINENCE * noise, 0.02 * float(np.ptp(smooth))))


def _initial(ts: np.ndarray, values: np.ndarray, noise: float, gap: float) -> InitialState:
    """Position and velocity at the first sample, from a parabola through the first few."""
    count = min(len(ts), max(5, 20 if noise > 0 else 5))
    parabola = np.polynomial.Polynomial.fit(
        ts[:count] - ts[0], values[:count] - gap, min(2, count - 1)
    )
    return InitialState(parabola(0.0), parabola.deriv()(0.0))


def _swinging(
    ts: np.ndarray, smooth: np.ndarray, noise: float, oscillator: AbstractOscillator
) -> tuple[AbstractOscillator, np.ndarray]:
    """Frequency and damping from the crossings and extremes of a free swing, and their times."""
    crossings = np.flatnonzero(np.diff(np.sign(smooth)) != 0)
    times, sizes, middles = [], [], []
    for a, b in pairwise(crossings):
        peak = a + int(np.argmax(np.abs(smooth[a : b + 1])))
        if abs(smooth[peak]) > _PROMINENCE * noise and b - a > 2:
            times.append(ts[b] - ts[a])
            sizes.append(abs(smooth[peak]))
            middles.append(ts[peak])
    if not times:
        return oscillator, np.zeros(0)
    omegas = oscillator.natural_frequency(np.array(sizes), 0.0, np.array(times))
    if omegas is None:
        return oscillator, np.array(middles)
    omega = float(np.median(omegas))
    rate = -np.polyfit(middles, np.log(sizes), 1)[0] if len(sizes) > 2 else 0.01 * omega
    zeta = float(np.clip(rate / omega, 1e-4, 0.5))
    return oscillator.with_motion(omega, zeta), np.array(middles)


def _impacting(
    ts: np.ndarray,
    smooth: np.ndarray,
    noise: float,
    oscillator: AbstractOscillator,
    initial: InitialState,
    contact: float,
    gap: float,
) -> FirstLook:
    """First look at an impacting motion: frequency from the durations of the flights, restitution
    from their successive heights.

    A swing that turns before it reaches the stop counts as a flight without an impact at its end.
    """
    turns = turns_of(smooth, noise)
    bounds = [0, *turns.tolist(), len(smooth) - 1]
    heights = np.array([smooth[a : b + 1].max() for a, b in pairwise(bounds)])
    durations = np.diff(ts[turns])
    full = heights[1:-1] if len(heights) > 2 else np.zeros(0)
    visible = full > _PROMINENCE * noise
    omegas = oscillator.natural_frequency(full, gap, durations) if visible.any() else None
    if omegas is not None:
        oscillator = oscillator.with_motion(float(np.median(omegas[visible])), _USUAL_DAMPING)
    speeds = oscillator.speed_at_stop(heights, gap)
    last = len(heights) - (0 if _has_turned(smooth, bounds[-2]) else 1)
    reaching = np.cumprod(speeds[:last] > 0)
    before = speeds[:last][reaching > 0]
    return FirstLook(
        oscillator,
        initial,
        before[:-1],
        before[1:] / before[:-1],
        contact,
        False,
        ts[turns[: np.count_nonzero(speeds[:-1] > 0)]],
    )


def _has_turned(smooth: np.ndarray, begin: int) -> bool:
    """True if the last flight of a record reaches its greatest height."""
    rest = smooth[begin:]
    return len(rest) > 4 and int(np.argmax(rest)) < len(rest) - 3
