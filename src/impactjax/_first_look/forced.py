"""First look at a motion whose base moves.

Between impacts the coordinate q obeys q″ = −ω_n² R(q) − 2 ζ ω_n q′ − g + Σ aᵢ fᵢ(t, q). Multiplied
by a weight that vanishes at both ends of a flight and integrated by parts, this is linear in ω_n²,
2 ζ ω_n and aᵢ, and contains no derivative of the record.

Source: D. A. Messenger and D. M. Bortz (2021), "Weak SINDy: Galerkin-based data-driven model
selection", Multiscale Modeling & Simulation 19, 1474.
"""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from impactjax._first_look.first_look import (
    CONTACT_SAMPLES,
    FirstLook,
    smoothed,
    stop_seen,
    turns_of,
)
from impactjax._model.initial_state import InitialState
from impactjax._model.oscillator import AbstractOscillator

_NEAR = 0.1  # distance of an impact from the stop, relative to the motion
_MARGIN = 3  # samples between an impact and the first one of a flight
_MOST = 20  # samples of a flight from which its speed at an end is estimated
_FEWEST = 4
_ERROR = 0.2  # largest relative error of such a speed
_FLIGHT = 24  # least number of samples of a flight in the regression
_PARTS = ((0.0, 1.0), (0.0, 0.6), (0.4, 1.0))  # of a flight, each with its own weight
_CLOSE = 2.0  # residuals of the first samples, in sizes of the noise
_SWINGS = 12  # parts of a motion without impacts
_DAMPING = (1e-4, 0.5)


def look_at_forced_motion(
    ts: np.ndarray,
    places: np.ndarray,
    oscillator: AbstractOscillator,
    gap: float,
    contact_duration: float | None,
) -> FirstLook:
    """First look at a coordinate sampled in time, of an oscillator whose base moves. Frequency,
    damping and the phase of the base follow from a regression over the flights, restitutions from
    the slopes on both sides of each impact.

    Arguments are those of `look_at_motion`.
    """
    heights = places + gap
    smooth, noise = smoothed(heights)
    turns = turns_of(smooth, noise)
    stop = stop_seen(heights, smooth, noise)
    near = (stop or 0.0) + _NEAR * float(np.ptp(smooth))
    impacts = turns[smooth[turns] < near]
    swings_freely = bool(smooth.min() < -0.25 * smooth.max())
    ends = [0, *([] if swings_freely else impacts.tolist()), len(ts) - 1]
    swings = np.linspace(0, len(ts) - 1, _SWINGS + 1).astype(int).tolist()
    oscillator, phase, pull = _moving(ts, places, oscillator, swings if swings_freely else ends)
    before, after = _speeds(ts, heights, pull, noise, ends).T
    seen = (before < 0) & (after > 0)
    lever = float(oscillator.lever())
    look = FirstLook(
        oscillator,
        _initial(ts, places, pull, noise, ends[1]),
        -before[seen] * lever,
        after[seen] / -before[seen],
        np.pi / (contact_duration or CONTACT_SAMPLES * float(np.median(np.diff(ts)))),
        swings_freely,
        ts[turns if swings_freely else impacts],
        phase=phase,
    )
    return look if stop is None else look._replace(elsewhere=stop - gap)


def _moving(
    ts: np.ndarray, places: np.ndarray, oscillator: AbstractOscillator, ends: list[int]
) -> tuple[AbstractOscillator, float | None, np.ndarray]:
    """The oscillator with the frequency and damping of its flights, the phase of the base, if it
    has one, and the acceleration at all samples but for friction.
    """
    weight = oscillator.weight()
    forces = oscillator.inertia(ts, places)
    pull = np.zeros_like(places) if weight is not None else -oscillator.restoring(places)
    rows, targets = [], []
    for flight in _flights(ends):
        t, q = ts[flight], places[flight]
        intervals = np.gradient(t)
        for share in _PARTS:
            w, dw, ddw = _weight(t, share) * intervals
            motion = [] if weight is not None else [dw @ q, pull[flight] @ w]
            rows.append([*motion, *(forces[:, flight] @ w)])
            targets.append(ddw @ q + (weight or 0.0) * w.sum())
    if len(rows) < len(forces) + 2:
        return oscillator, None, oscillator.free_acceleration(places)
    factors, *_ = np.linalg.lstsq(np.array(rows), np.array(targets))
    forced = factors[-len(forces) :] @ forces
    phase = math.atan2(factors[-1], factors[-2]) if len(forces) > 1 else None
    if weight is not None or not factors[1] > 0:
        return oscillator, phase, forced + oscillator.free_acceleration(places)
    omega = math.sqrt(factors[1])
    zeta = float(np.clip(factors[0] / (2 * omega), *_DAMPING))
    return oscillator.with_motion(omega, zeta), phase, forced + factors[1] * pull


def _flights(ends: list[int]) -> Iterator[slice]:
    """Samples of the flights between successive ends."""
    for begin, end in pairwise(ends):
        if end - begin - 2 * _MARGIN >= _FLIGHT:
            yield slice(begin + _MARGIN, end - _MARGIN + 1)


def _weight(t: np.ndarray, share: tuple[float, float]) -> np.ndarray:
    """The weight (1 − s²)⁴ and its first two derivatives by time, where s is −1 and 1 at both ends
    of a share of the flight.
    """
    begin, end = (t[0] + each * (t[-1] - t[0]) for each in share)
    rate = 2 / (end - begin)
    s = rate * (t - (begin + end) / 2)
    inside = np.maximum(1 - s**2, 0.0)
    return np.stack(
        [
            inside**4,
            -8 * s * inside**3 * rate,
            (48 * s**2 * inside**2 - 8 * inside**3) * rate**2,
        ]
    )


def _speeds(
    ts: np.ndarray, heights: np.ndarray, pull: np.ndarray, noise: float, ends: list[int]
) -> np.ndarray:
    """Velocities before and after each impact, from the samples beside it; NaN where there are too
    few, or too noisy ones.
    """
    found = np.full((len(ends) - 2, 2), np.nan)
    for i, (begin, at, end) in enumerate(zip(ends, ends[1:], ends[2:], strict=False)):
        sides = np.arange(at - _MARGIN, begin, -1), np.arange(at + _MARGIN, end)
        for side, near in enumerate(sides):
            if len(near) >= _FEWEST:
                (_, velocity), (_, error), _ = _state(ts, heights, pull, at, near[:_MOST])
                found[i, side] = velocity if noise * error < _ERROR * abs(velocity) else np.nan
    return found


def _state(
    ts: np.ndarray, places: np.ndarray, pull: np.ndarray, at: int, near: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place and velocity at a sample, from samples near it of a motion with a given acceleration;
    their errors divided by that of a sample, and the residuals.
    """
    path = np.arange(at, near[-1] + np.sign(near[-1] - at), np.sign(near[-1] - at))
    steps = np.diff(ts[path])
    rates = np.concatenate([[0.0], np.cumsum(steps * _means(pull[path]))])
    moved = np.concatenate([[0.0], np.cumsum(steps * _means(rates))])[np.isin(path, near)]
    basis = np.stack([np.ones(len(near)), ts[near] - ts[at]], axis=1)
    inverse = np.linalg.pinv(basis)
    state = inverse @ (places[near] - moved)
    return state, np.linalg.norm(inverse, axis=1), places[near] - moved - basis @ state


def _means(values: np.ndarray) -> np.ndarray:
    return (values[1:] + values[:-1]) / 2


def _initial(
    ts: np.ndarray, places: np.ndarray, pull: np.ndarray, noise: float, first: int
) -> InitialState:
    """State at the first sample, from those before the first impact, which is not seen as such if
    it follows at once.
    """
    count = min(max(min(first + 1 - _MARGIN, _MOST), _FEWEST), len(ts))
    while True:
        state, _, left = _state(ts, places, pull, 0, np.arange(count))
        if count <= _FEWEST or np.std(left) < _CLOSE * noise:
            return InitialState(*state)
        count = max(count // 2, _FEWEST)
