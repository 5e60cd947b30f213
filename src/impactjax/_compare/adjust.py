"""Sign of a record, position of the stop in it, and its usable part, from the record itself."""

import numpy as np

from impactjax._compare.oscillators import with_known
from impactjax._compare.setup import PHASE, Setup
from impactjax._compare.unstated_sensor import (
    with_possible_low_pass,
    with_unstated_instrument,
    with_unstated_sensor,
)
from impactjax._first_look.first_look import FirstLook
from impactjax._model.gravity import STANDARD_GRAVITY
from impactjax._problem.prior import Normal
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._sensor.sensor import Sensor

_BEYOND = 0.25  # ratio of the extremes below which a record lies on one side of the stop
WHERE = frozenset(("gap", "lower_gap", "offset", "gain"))
"""Parameters that determine the position of the stop in a record."""


def adjusted(
    recording: AbstractRecording, setup: Setup, said: set[str], chosen: bool, notes: list[str]
) -> tuple[AbstractRecording, FirstLook, Setup]:
    """The recording with its sign corrected and a hand's part cut off, the first look at it, and
    the setup with what follows from it. In a motion with impacts the parameters of the sensor that
    nobody stated are fitted.

    **Arguments:**

    - `recording`, `setup`: as given by the user.
    - `said`: parameters about which the user stated anything.
    - `chosen`: true if the user chose the part of the record to use.
    - `notes`: list to which a sentence on each change is appended.
    """
    look = _look(recording, setup)
    if not said & ({*WHERE, "theta0", "x0"} if recording.shows_place else {"gain"}):
        recording, look = _turned(recording, look, setup, notes)
    if _has_unstated_sensor(recording, setup, said):
        recording, look = _of_places(recording, look, setup, notes)
    if recording.shows_place and not said & WHERE and setup.upper is None:
        setup, look = _placed(recording, look, setup, notes)
    if setup.sensor.low_pass is None:
        recording = _with_jumps(recording, notes)
    if look.is_blow:
        setup = with_unstated_instrument(recording, setup, said)
    elif _hits(recording, look):
        setup = with_unstated_sensor(recording, look, setup, said)
    elif not (look.swings_freely or recording.observes_impacts):
        setup = with_possible_low_pass(recording, setup, said)
    if not chosen:
        recording, look, setup = _released(recording, look, setup, notes)
    if PHASE in setup.free and PHASE not in setup.start and look.phase is not None:
        setup = setup._replace(start={**setup.start, PHASE: look.phase})
    return recording, look, setup


def _has_unstated_sensor(recording: AbstractRecording, setup: Setup, said: set[str]) -> bool:
    """True for a velocity of whose sensor, and of whose stop, nobody states anything."""
    sensor, told = setup.sensor, said & {*WHERE, "drift", "cutoff"}
    plain = sensor.sigma is None and sensor.quantisation is None and sensor.low_pass is None
    return recording.shows_rate and plain and not told and setup.upper is None


def _of_places(
    recording: AbstractRecording, look: FirstLook, setup: Setup, notes: list[str]
) -> tuple[AbstractRecording, FirstLook]:
    """The recording of the places from which a velocity with impacts seems to be computed."""
    if look.swings_freely or not look.marks.size:
        return recording, look
    places = recording.places(look.marks)
    if places is None:
        return recording, look
    notes.append(
        f"The {recording.observed} seems to be computed from positions by differences, which "
        f"smooth every impact: the {places.observed} is restored by sums and fitted instead "
        "(`cutoff` under [sensor] keeps the record as it is)."
    )
    return places, _look(places, setup)


def _with_jumps(recording: AbstractRecording, notes: list[str]) -> AbstractRecording:
    """The recording with marked jumps, if it is a velocity that jumps from sample to sample."""
    marked = recording.with_jumps()
    if marked.shows_jumps:
        notes.append(
            f"The {recording.observed} jumps from one sample to the next: no low-pass is fitted, "
            "and the record cannot tell a contact shorter than a sample from a rigid stop."
        )
    return marked


def _hits(recording: AbstractRecording, look: FirstLook) -> bool:
    """True for a motion with impacts: one that passes through zero may hit a stop elsewhere."""
    if recording.shows_place:
        return not look.swings_freely or look.elsewhere is not None
    return recording.shows_rate and not look.swings_freely


def _look(recording: AbstractRecording, setup: Setup) -> FirstLook:
    """First look at the recording, with the known values of the setup."""
    given, sensor = {**setup.start, **setup.fixed}, setup.sensor
    known = Sensor(given.get("gain", sensor.gain), given.get("offset", sensor.offset))
    oscillator = with_known(setup.oscillator, given)
    gap = given.get("gap", given.get("lower_gap", 0.0))
    return recording.first_look(oscillator, gap, known)


def _turned(
    recording: AbstractRecording, look: FirstLook, setup: Setup, notes: list[str]
) -> tuple[AbstractRecording, FirstLook]:
    """The recording, with the opposite sign if it lies on the far side of the stop, if the stop
    seems to pull, or if a velocity or an acceleration shows rebounds only then.
    """
    lowest, highest = recording.span()
    rate = recording.shows_rate
    if highest >= _BEYOND * abs(lowest) and not (rate and look.swings_freely):
        return recording, look
    turned = recording.turned()
    other = _look(turned, setup)
    if rate and other.usual_restitutions.size > look.usual_restitutions.size:
        wrong = f"The {recording.observed} is negative in a rebound"
        usual = "a mass rebounds in positive direction"
    elif recording.shows_place and not other.swings_freely:
        wrong = "The record lies on the far side of the stop"
        usual = "places count from the stop towards the free side"
    elif recording.needs_force_law or other.is_blow:
        wrong, usual = "The record is negative in a contact", "a stop pushes with a positive force"
    else:
        return recording, look
    notes.append(
        f"{wrong}, so its sign is turned: {usual} (`gain = 1` under [sensor] keeps the sign)."
    )
    return turned, other


def _placed(
    recording: AbstractRecording, look: FirstLook, setup: Setup, notes: list[str]
) -> tuple[Setup, FirstLook]:
    """The setup with `gap` or `offset` free if impacts are visibly not at zero."""
    place = look.elsewhere
    if place is None:
        return setup, look
    unit, factor = recording.shown
    if setup.oscillator.has_equilibrium():
        free, start, fitted = ("gap", "offset"), {"gap": -place}, "`gap` and `offset` are"
    else:
        free, start, fitted = ("offset",), {"offset": place}, "`offset` is"
    notes.append(
        f"The impacts seem to be at {place * factor:.3g} {unit}, not at 0: {fitted} fitted as well "
        "(state `gap` under [fixed], or `offset` under [sensor], if it is known)."
    )
    setup = setup._replace(free=(*setup.free, *free), start={**setup.start, **start})
    return setup, _look(recording, setup)


def _released(
    recording: AbstractRecording, look: FirstLook, setup: Setup, notes: list[str]
) -> tuple[AbstractRecording, FirstLook, Setup]:
    """The part of the recording that the model describes.

    An accelerometer that was dropped fell from rest, since its record alone does not contain the
    initial velocity. It was let go up to one sample before that part, which bounds its first speed.
    """
    part = recording.free_part(look)
    if part is None:
        return recording, look, setup
    begin, end, reason, at_rest = part
    note = (
        f"{reason}: only {begin:.3f} to {end:.3f} s is fitted "
        "(`window` under [read] in the sidecar decides otherwise)."
    )
    asked = {*setup.start, *setup.fixed, *setup.free, *setup.priors}
    if at_rest and "x_dot0" not in asked:
        ts, _ = recording.axis
        speed = STANDARD_GRAVITY * float(np.median(np.diff(ts)))
        setup = setup._replace(priors={**setup.priors, "x_dot0": Normal(0.0, speed)})
        note = f"{note} It is taken to fall from rest, let go up to one sample earlier."
    notes.append(note)
    recording = recording.between(begin, end)
    return recording, _look(recording, setup), setup
