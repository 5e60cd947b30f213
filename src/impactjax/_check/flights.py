"""Motion between impacts in closed form, in NumPy: accurate enough to forecast errors.

A swing is harmonic with the period of its amplitude, a ball follows parabolas. An impact is a jump
of the velocity, or half an oscillation on a Kelvin-Voigt stop.
"""

import math
from typing import NamedTuple

import numpy as np

_MOST = 200  # impacts
_SLOWEST = 1e-3  # approach speed, relative to the first, below which the mass rests


class Motion(NamedTuple):
    """Motion of an oscillator with a lower stop; speeds and places are those of the coordinate.

    - `omega_n`, `zeta`: natural frequency [rad/s] and damping ratio; no swing if `omega_n` is 0.
    - `weight`: constant acceleration towards the stop.
    - `place`, `rate`: state at the beginning.
    - `gap`: distance of the stop; infinite without one.
    - `r0`, `alpha`: restitution r0 − α v of a rigid stop.
    - `omega0`, `gamma`: contact of a compliant stop, which is rigid for ω0 = 0.
    - `is_angle`: true for a pendulum, whose period depends on its amplitude.
    """

    omega_n: float
    zeta: float
    weight: float
    place: float
    rate: float
    gap: float
    r0: float
    alpha: float
    omega0: float = 0.0
    gamma: float = 0.0
    is_angle: bool = False

    def along(self, ts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places at some times, and times of the impacts."""
        places, hits = np.full(len(ts), -self.gap if math.isfinite(self.gap) else 0.0), []
        t, q, v, fastest = float(ts[0]), self.place, self.rate, 0.0
        while len(hits) < _MOST and t <= ts[-1]:
            duration, speed = self._flight(q, v)
            inside = slice(*np.searchsorted(ts, [t, t + duration]))
            places[inside] = self._places(ts[inside] - t, q, v)
            t += duration
            fastest = max(fastest, speed)
            if not (t <= ts[-1] and speed > _SLOWEST * fastest):
                break
            hits.append(t)
            t, v = self._rebound(ts, places, t, speed)
            q = -self.gap
        return places, np.array(hits)

    def _swing(self, q: float, v: float) -> tuple[float, float, float]:
        """Frequency, amplitude and phase of A cos(ω s − φ)."""
        omega = self.omega_n
        if self.is_angle:
            a = min(math.hypot(q, v / omega), 3.0)
            omega *= 1 - a**2 / 16 + a**4 / 3072
        return omega, math.hypot(q, v / omega), math.atan2(v / omega, q)

    def _flight(self, q: float, v: float) -> tuple[float, float]:
        """Duration of a flight, and the speed at its end."""
        if self.omega_n > 0:
            omega, a, phase = self._swing(q, v)
            if a <= self.gap or not math.isfinite(self.gap):
                return math.inf, 0.0
            turn = math.acos(max(-self.gap / a, -1.0))
            duration = (turn + phase) / omega
            duration += 0.0 if duration > 0 else 2 * math.pi / omega
            fade = math.exp(-self.zeta * self.omega_n * duration)
            return duration, a * omega * math.sin(turn) * fade
        speed = math.sqrt(max(v**2 + 2 * self.weight * (q + self.gap), 0.0))
        if self.weight > 0:
            return (v + speed) / self.weight, speed
        return ((q + self.gap) / -v, -v) if v < 0 else (math.inf, 0.0)

    def _places(self, s: np.ndarray, q: float, v: float) -> np.ndarray:
        if self.omega_n == 0:
            return q + v * s - self.weight * s**2 / 2
        omega, a, phase = self._swing(q, v)
        return np.exp(-self.zeta * self.omega_n * s) * a * np.cos(omega * s - phase)

    def _rebound(
        self, ts: np.ndarray, places: np.ndarray, t: float, speed: float
    ) -> tuple[float, float]:
        """Time and speed after an impact; the places during contact are written."""
        if self.omega0 == 0:
            return t, (self.r0 - self.alpha * speed) * speed
        swing = self.omega0 * math.sqrt(1 - self.gamma**2)
        end = t + math.pi / swing
        inside = slice(*np.searchsorted(ts, [t, end]))
        s = ts[inside] - t
        fade = np.exp(-self.gamma * self.omega0 * s)
        places[inside] = -self.gap - speed / swing * fade * np.sin(swing * s)
        return end, speed * math.exp(-math.pi * self.gamma * self.omega0 / swing)
