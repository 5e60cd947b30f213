"""Forecast of standard errors: which parameters a record like this can bound.

The Cramér-Rao bound of a motion with typical values and the noise of the record, in NumPy.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from impactjax._check.flights import Motion
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.setup import Setup
from impactjax._compare.survey import Survey
from impactjax._model.linear_contact import damping_ratio
from impactjax._model.swing import AbstractSwing
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.recording import Recording
from impactjax._record.sample_noise import Noise
from impactjax._sensor.filtered_samples import filtered_samples
from impactjax._sensor.low_pass import Butterworth

_STEP = 1e-5  # of a parameter, relative to its scale
_SINGULAR = 1e-12  # least eigenvalue of the scaled information that counts
_FAST = 0.4  # cutoff of a low-pass with a small effect, relative to the sampling rate
_LONGEST, _SHORTEST = 20e-3, 5e-6  # [s], range of contact durations
_HALVINGS = 10
_CONSTANT = {"r": ("r0", 1.0, "1")}
_SOFT = {"omega0": ("omega0", 1.0, "rad/s"), "gamma": ("gamma", 1.0, "1")}
_SWING = {"omega_n": ("omega_n", 1.0, "rad/s"), "zeta": ("zeta", 1.0, "1")}
BOUNDED = 0.5  # largest relative error with which a contact's duration has a bound on both sides


class Forecast(NamedTuple):
    """Expected standard error of a parameter.

    - `value`, `error`: its value in the first look, and the error.
    """

    name: str
    value: float
    error: float
    unit: str


class Forecasts(NamedTuple):
    """Expected standard errors in a record.

    - `motion`: of the motion, and of a constant restitution.
    - `line`: of the restitution r0 − α v.
    - `gamma`: of the damping ratio of a contact, at the shortest duration that the record bounds.
    - `shortest`: shortest duration of a contact [s] that has a bound on both sides; 0 if all have,
      infinite if none has.
    """

    motion: tuple[Forecast, ...]
    line: tuple[Forecast, ...] = ()
    gamma: Forecast | None = None
    shortest: float = math.inf


def forecasts(found: Survey, noise: Noise) -> Forecasts | None:
    """Forecast for a survey; `None` for a quantity or an oscillator without one, for a base that
    moves, and for a record without visible noise.
    """
    recording, look = found.recording, found.look
    sampled = isinstance(recording, Recording)
    if sampled and recording.quantity.derivative not in (0, 1):
        return None
    known = {type(make()) for make in OSCILLATORS.values()}
    has_closed_form = type(look.oscillator) in known and not look.oscillator.is_forced()
    if not has_closed_form or not noise.size > 0:
        return None
    rows = _rows(found, noise)
    stops = not look.swings_freely
    lever = rows.lever
    rigid = rows.usual._replace(gap=rows.usual.gap if stops else math.inf)
    if recording.observes_impacts:
        told = rows.errors(rigid, _CONSTANT)
        rows = rows._replace(noise=_with_scatter(noise, look.restitutions, told))
    if not stops:
        return Forecasts(rows.errors(rigid, {}))
    r0, slope = look.restitution_line
    line = rigid._replace(r0=r0, alpha=slope * lever)
    of_line = rows.errors(line, {"r0": ("r0", 1.0, "1"), "alpha": ("alpha", lever, "s/m")})
    told = Forecasts(
        rows.errors(rigid, _CONSTANT),
        tuple(each for each in of_line if each.name in ("r", "r0", "alpha")),
    )
    return told if rows.known & {*_SOFT} else _with_contact(told, rows, rigid)


def _with_contact(told: Forecasts, rows: "_Rows", rigid: Motion) -> Forecasts:
    """The forecasts with those of a Kelvin-Voigt contact of the same restitution."""
    gamma = float(damping_ratio(np.clip(rigid.r0, 0.05, 0.98)))

    def soft(duration: float) -> dict[str, Forecast]:
        omega0 = math.pi / (duration * math.sqrt(1 - gamma**2))
        found = rows.errors(rigid._replace(omega0=omega0, gamma=gamma), _SOFT)
        return {each.name: each for each in found}

    shortest, at = _shortest(soft)
    return told._replace(gamma=soft(at)["gamma"], shortest=shortest)


def _with_scatter(noise: Noise, ratios: np.ndarray, found: tuple[Forecast, ...]) -> Noise:
    """The noise of impact times, as large as the mean of the flights' ratios is uncertain: times
    alone do not tell an error of the clock from a restitution that changes from impact to impact,
    and then adds up.
    """
    own = {each.name: each.error for each in found}
    if "r" not in own or len(ratios) < 3:
        return noise
    plain = float(np.std(ratios, ddof=1)) / math.sqrt(len(ratios))
    return noise._replace(size=noise.size * max(plain / own["r"], 1.0))


def _shortest(soft: Callable[[float], dict[str, Forecast]]) -> tuple[float, float]:
    """The shortest contact with a bound on both sides, by bisection, and one that is in range."""

    def bounded(duration: float) -> bool:
        own = soft(duration)["omega0"]
        return own.error < BOUNDED * own.value

    if not bounded(_LONGEST):
        return math.inf, _LONGEST
    if bounded(_SHORTEST):
        return 0.0, _SHORTEST
    low, high = _SHORTEST, _LONGEST
    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if bounded(middle) else (middle, high)
    return high, high


class _Rows(NamedTuple):
    """Observations of a motion like the recorded one, and their derivatives.

    - `noise`, `setup`, `recording`: of the survey.
    - `usual`: motion of the first look, with a rigid stop.
    - `lever`: ratio of a speed [m/s] to that of the coordinate.
    - `ts`: times of the observations [s].
    """

    noise: Noise
    setup: Setup
    recording: AbstractRecording
    usual: Motion
    lever: float
    ts: np.ndarray

    @property
    def known(self) -> set[str]:
        """Names of the parameters that are not fitted."""
        return {*self.setup.fixed, *self.setup.held}

    def errors(
        self, motion: Motion, contact: dict[str, tuple[str, float, str]]
    ) -> tuple[Forecast, ...]:
        """Forecasts of all parameters that a fit would find.

        `contact` holds those of the contact: the field of `motion`, the divisor that gives the
        parameter from the field's value, and the unit.
        """
        place, unit = ("theta", "rad") if motion.is_angle else ("x", "m")
        names = {} if motion.omega_n == 0 else _SWING
        names = {**names, **contact, f"{place}_dot0": ("rate", 1.0, f"{unit}/s")}
        if not self.recording.observes_impacts:
            names |= {f"{place}0": ("place", 1.0, unit)}
        names = {name: each for name, each in names.items() if name not in self.known}
        if "gap" in self.setup.free and math.isfinite(motion.gap):
            names["gap"] = ("gap", 1.0, unit)
        if not names:
            return ()
        columns = [self._slope(motion, field) for field, _, _ in names.values()]
        if "offset" in self.setup.free or self.recording.observes_impacts:
            columns.append(np.ones_like(columns[0]))
        if "drift" in self.setup.free:
            columns.append(self.ts)
        if "gain" in self.setup.free:
            columns.append(np.nan_to_num(self._observed(motion)))
        if "cutoff" in self.setup.free:
            columns.append(np.nan_to_num(self._smoothed(motion)))
        errors = self._bound(np.stack(columns, axis=1) * self._weights(motion)[:, None])
        return tuple(
            Forecast(name, getattr(motion, field) / by, float(error) / by, unit)
            for (name, (field, by, unit)), error in zip(names.items(), errors, strict=False)
        )

    def _slope(self, motion: Motion, field: str) -> np.ndarray:
        value = getattr(motion, field)
        scale = {"rate": max(abs(value), 0.1), "alpha": 0.1, "zeta": 0.01, "gap": 0.01}
        step = _STEP * scale.get(field, max(abs(value), 1e-3))
        above = self._observed(motion._replace(**{field: value + step}))
        below = self._observed(motion._replace(**{field: value - step}))
        slope = (above - below) / (2 * step)
        return np.where(np.isfinite(slope), slope, 0.0)

    def _observed(self, motion: Motion) -> np.ndarray:
        if self.recording.observes_impacts:
            later = self.ts[0] + 2 * (self.ts[-1] - self.ts[0])
            count = len(self.ts)
            hits = motion.along(np.linspace(self.ts[0], later, 8))[1][: count - 1]
            return np.concatenate([[0.0], hits, np.full(count - 1 - len(hits), np.nan)])
        values, _ = motion.along(self.ts)
        assert isinstance(self.recording, Recording)
        if not self.recording.shows_place:
            values = np.gradient(values, self.ts)
        return self._filtered(values)

    def _smoothed(self, motion: Motion) -> np.ndarray:
        """Change of the observations by a fast low-pass."""
        values, rate = self._observed(motion), 1 / (self.ts[1] - self.ts[0])
        return filtered_samples(Butterworth(_FAST * rate), values, rate) - values

    def _filtered(self, values: np.ndarray) -> np.ndarray:
        low_pass, rate = self.setup.known_low_pass, 1 / (self.ts[1] - self.ts[0])
        if not isinstance(low_pass, Butterworth) or float(low_pass.cutoff) > 0.45 * rate:
            return values
        return filtered_samples(low_pass, values, rate)

    def _weights(self, motion: Motion) -> np.ndarray:
        """Weights of the observations: of a velocity that jumps, the samples beside a jump tell its
        instant to within an interval.
        """
        values = np.nan_to_num(self._observed(motion))
        if not self.recording.shows_jumps:
            return np.ones_like(values)
        jumps = np.abs(np.convolve(values, [1.0, 0.0, -1.0], mode="same"))
        return 1 / np.maximum(jumps / (math.sqrt(12) * self.noise.size), 1.0)

    def _bound(self, slopes: np.ndarray) -> np.ndarray:
        """Square roots of the diagonal of the inverse information."""
        seen = slopes[np.asarray(self.recording.valid)[: len(slopes)]]
        sizes = np.linalg.norm(seen, axis=0)
        scaled = seen / np.where(sizes > 0, sizes, 1.0)
        values, vectors = np.linalg.eigh(scaled.T @ scaled)
        variances = (vectors**2) @ (1 / np.maximum(values, _SINGULAR))
        size = self.noise.size * math.sqrt(self.noise.memory)
        return np.where(
            sizes > 0, size * np.sqrt(variances) / np.where(sizes > 0, sizes, 1), np.inf
        )


def _rows(found: Survey, noise: Noise) -> _Rows:
    recording, look, setup = found.recording, found.look, found.setup
    oscillator = look.oscillator
    swing = isinstance(oscillator, AbstractSwing)
    usual = Motion(
        float(oscillator.omega_n) if swing else 0.0,
        float(oscillator.zeta) if swing else 0.0,
        0.0 if swing else float(oscillator.weight() or 0.0),
        float(look.initial.position),
        float(look.initial.velocity),
        float({**setup.start, **setup.fixed}.get("gap", 0.0)),
        look.restitution,
        0.0,
        is_angle=oscillator.is_angle(),
    )
    instants = np.asarray(recording.instants, float)
    ts = np.linspace(instants[0], np.nanmax(instants), len(instants))
    return _Rows(noise, setup, recording, usual, float(oscillator.lever()), ts)
