"""An independent reference: Taylor series of order 36 in 36-digit arithmetic.

Derivatives are central differences in the same arithmetic (step 1e-11, so about 20 digits remain).
"""

from collections.abc import Iterator
from functools import cache
from typing import Any

import mpmath
import numpy as np

from . import tasks

ORDER = 36
CONTEXT = mpmath.MPContext()
CONTEXT.dps = 36
TOLERANCE = CONTEXT.mpf(10) ** -35
DIFFERENCE = CONTEXT.mpf(10) ** -11
FLIGHT, CONTACT = 0, 1

# real, but mpmath types its functions for complex numbers, too
Number = Any
Series = list[Number]


def _product(a: Series, b: Series, k: int) -> Number:
    """Coefficient k of the product of two series."""
    return CONTEXT.fdot(zip(a[: k + 1], b[k::-1], strict=True))


class _Pendulum:
    """The equations of one parameter vector, with the solution's Taylor series in either mode."""

    def __init__(self, law: str, values: list[Number], forcing: tasks.Forcing) -> None:
        self.law = law
        named = dict(zip(tasks.NAMES[law], values, strict=True))
        self.theta0 = named["theta0"]
        self.r = named.get("r", CONTEXT.mpf(1))
        omega_n, zeta = named["omega_n"], named["zeta"]
        self.damping, self.stiffness = [2 * zeta * omega_n], [omega_n**2]
        if law == tasks.KELVIN_VOIGT:
            self.damping.append(2 * named["gamma"] * named["omega0"])
            self.stiffness.append(named["omega0"] ** 2)
        self.frequency = CONTEXT.mpf(forcing.frequency)
        self.push = CONTEXT.mpf(forcing.ratio) * self.frequency**2

    def _force(self, t: Number) -> Series:
        """The series of (A/L) Ω² sin(Ωt) about t."""
        now = [CONTEXT.sin(self.frequency * t), CONTEXT.cos(self.frequency * t)]
        scale, series = self.push, []
        for k in range(ORDER):
            sign = -1 if k % 4 in (2, 3) else 1
            series.append(sign * scale * now[k % 2])
            scale = scale * self.frequency / (k + 1)
        return series

    def series(self, mode: int, t: Number, angle: Number, rate: Number) -> Series:
        """Taylor coefficients of θ about t."""
        x, v = [angle], [rate]
        sine, cosine = [CONTEXT.sin(angle)], [CONTEXT.cos(angle)]
        force = self._force(t) if self.push else None
        slope: Series = []
        for k in range(ORDER):
            pull = sine[k] if mode == FLIGHT else x[k]
            push = _product(force, cosine, k) if force else 0
            x.append(v[k] / (k + 1))
            v.append((push - self.damping[mode] * v[k] - self.stiffness[mode] * pull) / (k + 1))
            slope.append((k + 1) * x[k + 1])
            sine.append(_product(slope, cosine, k) / (k + 1))
            cosine.append(-_product(slope, sine, k) / (k + 1))
        return x


def _horner(a: Series, h: Number) -> Number:
    total = CONTEXT.mpf(0)
    for coefficient in reversed(a):
        total = total * h + coefficient
    return total


def _derivative(a: Series) -> Series:
    return [k * c for k, c in enumerate(a)][1:]


def _step_length(a: Series) -> Number:
    """The step at which the last two coefficients fall below the tolerance."""
    return min((TOLERANCE / abs(a[k])) ** (CONTEXT.mpf(1) / k) for k in (ORDER, ORDER - 1) if a[k])


def _crossing(a: Series, h: Number, sign: int) -> Number | None:
    """The first time in (0, h] at which the series leaves the side `sign`, if it does."""
    a = a[1:] if a[0] == 0 else a
    pieces = 16
    before = CONTEXT.mpf(0)
    for i in range(1, pieces + 1):
        after = h * i / pieces
        if sign * _horner(a, after) < 0:
            return _root(a, before, after, sign)
        before = after
    return None


def _root(a: Series, low: Number, high: Number, sign: int) -> Number:
    """Newton's method kept inside a bracket."""
    slope, x = _derivative(a), (low + high) / 2
    for _ in range(200):
        value = _horner(a, x)
        low, high = (x, high) if sign * value > 0 else (low, x)
        new = x - value / _horner(slope, x)
        new = new if low < new < high else (low + high) / 2
        if abs(new - x) < TOLERANCE:
            return new
        x = new
    return x


def _pieces(
    law: str, values: list[Number], forcing: tasks.Forcing, end: float
) -> Iterator[tuple[Number, Number, Series]]:
    """Pieces (start, length, series of θ) of the trajectory, one after the other."""
    pendulum = _Pendulum(law, values, forcing)
    t, mode, angle, rate = CONTEXT.mpf(0), FLIGHT, pendulum.theta0, CONTEXT.mpf(0)
    while t < end:
        a = pendulum.series(mode, t, angle, rate)
        h = min(_step_length(a), end - t)
        hit = _crossing(a, h, 1 if mode == FLIGHT else -1)
        h = h if hit is None else hit
        yield t, h, a
        t, angle, rate = t + h, _horner(a, h), _horner(_derivative(a), h)
        if hit is not None:
            angle = CONTEXT.mpf(0)
            if law == tasks.RESTITUTION:
                rate = -pendulum.r * rate
            else:
                mode = 1 - mode


def _solve(
    law: str, values: list[Number], times: np.ndarray, forcing: tasks.Forcing = tasks.NO_FORCING
) -> np.ndarray:
    """θ at the sample times, as numbers of high precision."""
    out, i = np.empty(times.size, object), 0
    for t, h, a in _pieces(law, values, forcing, float(times[-1]) + 1e-12):
        while i < times.size and times[i] < t + h:
            out[i] = _horner(a, CONTEXT.mpf(float(times[i])) - t)
            i += 1
    return out


def _exact(values: np.ndarray) -> list[Number]:
    return [CONTEXT.mpf(float(value)) for value in values]


def angles(
    law: str, values: np.ndarray, times: np.ndarray, forcing: tasks.Forcing = tasks.NO_FORCING
) -> np.ndarray:
    """θ at the sample times, correct to double precision."""
    return _solve(law, _exact(values), times, forcing).astype(float)


def derivatives(law: str, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """∂θ/∂parameter at the sample times, one row a parameter."""
    rows = []
    for i in range(values.size):
        up, down = _exact(values), _exact(values)
        up[i] += DIFFERENCE
        down[i] -= DIFFERENCE
        rows.append((_solve(law, up, times) - _solve(law, down, times)) / (2 * DIFFERENCE))
    return np.array(rows, object).astype(float)


@cache
def record(law: str) -> np.ndarray:
    """The noisy record of T5 [rad]."""
    return angles(law, tasks.parameters(law), tasks.TIMES) + tasks.noise()


@cache
def best_fit(law: str) -> tuple[np.ndarray, np.ndarray]:
    """The least-squares estimate of T5 and its standard errors, by Gauss-Newton."""
    fitted = tasks.parameters(law)[:-1]
    deviations = np.zeros_like(fitted)
    for _ in range(8):
        values = tasks.with_start_angle(fitted)
        jacobian = derivatives(law, values, tasks.TIMES)[:-1]
        residual = record(law) - angles(law, values, tasks.TIMES)
        deviations = tasks.NOISE * np.sqrt(np.diag(np.linalg.inv(jacobian @ jacobian.T)))
        step = np.linalg.lstsq(jacobian.T, residual, rcond=None)[0]
        fitted = fitted + step
        if np.all(np.abs(step) < 1e-6 * deviations):
            break
    return fitted, deviations
