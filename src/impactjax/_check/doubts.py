"""Doubts about a record: what looks wrong before any fit."""

from collections.abc import Iterator

import numpy as np

from impactjax._check.stated import doubts_about_statements
from impactjax._compare.falling import OFF, are_of_gravity, gravities
from impactjax._compare.survey import Survey
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._record.recording import Recording
from impactjax._record.sample_noise import Noise

_UNEVEN = 0.2  # deviation of an interval from the median, relative to it
_COARSE = 12  # samples of a flight or a swing
_STEPS = 1.0  # least ratio of the step to the noise at which steps matter
_FLAT = 0.02  # middle of a free swing, relative to its amplitude
_LOUD = 0.05  # noise relative to the motion


def doubts(found: Survey, noise: Noise) -> tuple[str, ...]:
    """Sentences on what looks wrong in a record, each with a remedy."""
    return (
        *_clock(found),
        *_values(found, noise),
        *doubts_about_statements(found, noise),
        *_impacts(found),
        *_middle(found, noise),
    )


def _clock(found: Survey) -> Iterator[str]:
    recording, marks = found.recording, found.look.marks
    if not isinstance(recording, Recording):
        return
    intervals = np.diff(np.asarray(recording.ts))
    usual = float(np.median(intervals))
    wrong = np.count_nonzero(np.abs(intervals - usual) > _UNEVEN * usual)
    if wrong:
        worst = float(np.max(intervals)) * 1e3
        yield (
            f"{wrong} of {len(intervals)} intervals differ from the usual one, {usual * 1e3:.4g} "
            f"ms, by more than 20 % (the longest is {worst:.4g} ms): check the clock."
        )
    if len(marks) > 1 and (samples := float(np.median(np.diff(marks))) / usual) < _COARSE:
        yield f"A flight has only {samples:.0f} samples: record faster."


def _values(found: Survey, noise: Noise) -> Iterator[str]:
    recording = found.recording
    if not isinstance(recording, Recording):
        return
    (unit, factor), sensor = recording.shown, found.setup.sensor
    low, high = recording.span()
    if noise.step > _STEPS * noise.size and sensor.quantisation is None:
        yield (
            f"The values are multiples of {noise.step * factor:.3g} {unit}, more than the noise: "
            f"state `quantisation = {noise.step:.3g}` under [sensor]."
        )
    if noise.memory > 1 and sensor.low_pass is None:
        yield (
            "The noise is smooth from sample to sample, as after a filter: state its `cutoff` "
            "under [sensor], or contacts seem longer than they are."
        )
    if recording.shows_rate:
        yield from _computation(recording, noise, "cutoff" in found.setup.free)
    if noise.size > _LOUD * (high - low):
        share = 100 * noise.size / (high - low)
        yield f"The noise is {share:.0f} % of the range of the record."


def _computation(recording: Recording, noise: Noise, filters: bool) -> Iterator[str]:
    """Sentence on a rate that a program may have computed from places."""
    if noise.difference_lag:
        yield (
            f"The {recording.observed} seems to be computed from positions by differences, which "
            "smooth every impact: record the positions, or contacts seem longer than they are."
        )
    elif noise.memory > 1 and filters:
        yield (
            "The noise is smooth from sample to sample. A filter of the sensor is fitted; but if "
            f"the {recording.observed} was computed from positions, record these, or contacts seem "
            "longer than they are."
        )


def _impacts(found: Survey) -> Iterator[str]:
    look, recording = found.look, found.recording
    seen = isinstance(recording, Recording) and recording.quantity.contacts(_valid(recording))
    if not (look.swings_freely or len(look.marks) or seen):
        yield "No impact and no free swing was found: check the column, its unit and its sign."
    beyond = int(np.count_nonzero(look.restitutions > 1))
    if beyond:
        yield (
            f"{_number(beyond, 'impact')} of {look.restitutions.size} seem to have a restitution "
            "above 1: check the zero of the record and the position of the stop, and whether "
            "something else moves it."
        )
    if look.oscillator.is_angle() and found.setup.fixed.get("length") is None:
        given = getattr(look.oscillator, "length", None)
        if given is None and not look.swings_freely:
            yield (
                "The distance from the pivot to the point of contact is not stated, so that speeds "
                "in m/s are those of a point mass: state `length` under [fixed]."
            )
    weight, fallen = look.oscillator.weight(), gravities(recording, look)
    if not fallen.size:
        return
    own = float(np.median(fallen))
    if weight is None and are_of_gravity(fallen):
        yield (
            f"The flights are those of a falling mass, with {own:.3g} m/s²: a ball is "
            "`--system bouncing-ball`."
        )
    if weight is not None and abs(own / weight - 1) > OFF:
        yield (
            f"The flights have a gravity of {own:.3g} m/s² instead of {weight:.3g}: check the "
            f"scale (`gain = {own / STANDARD_GRAVITY:.3g}` under [sensor]) and the clock."
        )


def _middle(found: Survey, noise: Noise) -> Iterator[str]:
    """Sentence on a free swing whose middle is not zero."""
    look, recording = found.look, found.recording
    if not (look.swings_freely and len(look.marks) > 3 and isinstance(recording, Recording)):
        return
    if not recording.shows_place or "offset" in found.setup.free:
        return
    at = np.interp(look.marks, np.asarray(recording.ts), np.asarray(recording.values))
    middles = (at[:-2] + 2 * at[1:-1] + at[2:]) / 4
    middle, size = float(np.median(middles)), float(np.max(np.abs(at)))
    if abs(middle) > max(_FLAT * size, 3 * noise.size):
        unit, factor = recording.shown
        yield (
            f"The middle of the swing is at {middle * factor:.3g} {unit}, not at 0: let `offset` "
            "be fitted (--free offset)."
        )


def _valid(recording: Recording) -> np.ndarray:
    return np.asarray(recording.values)[np.asarray(recording.valid)]


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
