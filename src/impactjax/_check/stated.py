"""Doubts about what is stated beside a record: does the record contradict it?"""

from collections.abc import Iterator

import numpy as np

from impactjax._compare.survey import Survey
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._record.recording import Recording
from impactjax._record.sample_noise import Noise

_OTHER = 3.0  # ratio of the stated noise to that of the record
_COARSE = 4.0  # ratio of the stated step to the noise above which the steps are seen
_LATE = 0.1  # delay relative to the duration of the record
_BEYOND = 0.1  # way beyond a stop, relative to the range of the record
_LONG = 5.0  # ratio of a lever to that of a simple pendulum of the same frequency


def doubts_about_statements(found: Survey, noise: Noise) -> Iterator[str]:
    """Sentences on stated values that the record contradicts, each with a remedy."""
    if isinstance(found.recording, Recording):
        yield from _sensor(found, found.recording, noise)
        if found.recording.shows_place:
            yield from _place(found, found.recording)
    yield from _lever(found)


def _sensor(found: Survey, recording: Recording, noise: Noise) -> Iterator[str]:
    (unit, factor), sensor = recording.shown, found.setup.sensor
    size = f"{noise.size * factor:.3g} {unit}"
    if sensor.sigma is not None and noise.size > 0:
        stated = float(np.asarray(sensor.sigma))
        if not 1 / _OTHER < stated / noise.size < _OTHER:
            yield (
                f"The stated noise, `sigma` = {stated * factor:.3g} {unit}, is "
                f"{stated / noise.size:.3g} times that of the record, {size}: leave it out to have "
                "it estimated."
            )
    if sensor.quantisation is not None:
        step = float(np.asarray(sensor.quantisation))
        if step > _COARSE * max(noise.size, noise.step) > 0:
            yield (
                f"The stated steps, `quantisation` = {step * factor:.3g} {unit}, are not in the "
                f"record, whose noise is {size}: leave them out."
            )
    delay, duration = float(np.asarray(sensor.delay)), float(np.ptp(np.asarray(recording.ts)))
    if abs(delay) > _LATE * duration:
        yield (
            f"The stated `delay` of {delay:.3g} s is {100 * abs(delay) / duration:.0f} % of the "
            "record: is it in milliseconds?"
        )


def _place(found: Survey, recording: Recording) -> Iterator[str]:
    (unit, factor), (low, high) = recording.shown, recording.span()
    upper = found.setup.upper
    if upper is not None and high - upper.gap > _BEYOND * (high - low):
        yield (
            f"The record goes up to {high * factor:.3g} {unit}, beyond the upper stop at "
            f"{upper.gap * factor:.3g} {unit}: check its `gap` under [upper]."
        )
    farthest = max(abs(low), abs(high))
    if found.look.oscillator.is_angle() and farthest > 2 * np.pi:
        yield (
            f"The angle reaches {farthest:.4g} rad, more than a turn: are these degrees, and is "
            "the unit of the column wrong?"
        )


def _lever(found: Survey) -> Iterator[str]:
    length, oscillator = found.setup.fixed.get("length"), found.look.oscillator
    frequency = getattr(oscillator, "omega_n", None) if oscillator.is_angle() else None
    if length is None or frequency is None:
        return
    simple = STANDARD_GRAVITY / float(np.asarray(frequency)) ** 2
    if length > _LONG * simple:
        yield (
            f"The stated `length` of {length:.3g} m is {length / simple:.3g} times that of a "
            "simple pendulum of this frequency: is it in millimetres?"
        )
