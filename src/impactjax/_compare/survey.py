"""The survey of a recording: all that is known of it, and seen in it before any fit."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import numpy as np

from impactjax._compare.adjust import WHERE, adjusted
from impactjax._compare.falling import are_of_a_fall, are_of_gravity, gravities
from impactjax._compare.named import check_law
from impactjax._compare.oscillators import (
    DRAG,
    DRY_FRICTION,
    OSCILLATORS,
    may_have_drag,
    with_drag,
)
from impactjax._compare.requests import check_requests
from impactjax._compare.setup import Setup, setup_of
from impactjax._compare.typical_systems import Law
from impactjax._compare.unstated_sensor import with_named_low_pass
from impactjax._first_look.first_look import FirstLook
from impactjax._model.bouncing_ball import BouncingBall
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import ranges
from impactjax._problem.prior import Normal
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.read_recording import RecordingFile, count_of, read_recording
from impactjax._refusal import check_kind
from impactjax._sensor.sensor import Sensor


class Survey(NamedTuple):
    """A recording with all that is known of it and seen in it before any fit.

    - `name`: name of the recording.
    - `file`: file with its sidecar; `None` for a recording from memory.
    - `recording`: recording with its sign corrected and a hand's part cut off.
    - `look`: first estimates.
    - `setup`: all that is known besides the recording.
    - `why`: reason for its oscillator, in words.
    - `notes`: sentences on samples left out, a sign turned and values assumed.
    """

    name: str
    file: RecordingFile | None
    recording: AbstractRecording
    look: FirstLook
    setup: Setup
    why: str
    notes: tuple[str, ...]


class Statements(NamedTuple):
    """Statements about a recording, beside those of its sidecar: the arguments of `prepare`."""

    oscillator: AbstractOscillator | None = None
    laws: Sequence[Law] | None = None
    sensor: Sensor | None = None
    fixed: Mapping[str, float | None] = {}
    start: Mapping[str, float] = {}
    free: Sequence[str] = ()
    priors: Mapping[str, Normal] = {}


def survey(
    record: str | Path | RecordingFile | AbstractRecording, said: Statements = Statements()
) -> Survey:
    """Survey of a recording; errors are those of `prepare`. Where nobody states the oscillator, and
    the flights of a recorded height have the acceleration of gravity, it is a ball. If they have a
    smaller one, it is that of a mass on an incline, and is fitted.
    """
    if isinstance(record, str | Path):
        record = read_recording(record)
    found = _surveyed(record, said)
    accelerations = gravities(found.recording, found.look)
    falls = are_of_gravity(accelerations)
    if not (falls or are_of_a_fall(accelerations, found.look)) or not _is_open(found, said):
        return found
    usual = float(np.median(accelerations))
    own = BouncingBall() if falls else BouncingBall(gravity=usual)
    free = said.free if falls else (*said.free, "gravity")
    ball = _surveyed(record, said._replace(oscillator=own, free=free))
    why = f"as its flights have an acceleration of {usual:.3g} m/s²"
    other = "" if falls else ", which is fitted: the mass is on an incline, or the scale is wrong"
    note = (
        f"The system is a bouncing ball, {why}{other} (`--system`, or `oscillator` under [system], "
        "decides otherwise)."
    )
    return ball._replace(why=why, notes=(*ball.notes, note))


def _is_open(found: Survey, said: Statements) -> bool:
    """True if nobody states anything of the oscillator."""
    recording, file, setup = found.recording, found.file, found.setup
    usual = OSCILLATORS[recording.usual_oscillator]()
    told = {*said.fixed, *said.start, *said.free, *said.priors}
    if file is not None:
        told |= _told(file, setup)
    if said.oscillator is not None or setup.dry_friction or told & {*ranges(usual)}:
        return False
    stated = file is not None and file.sidecar.system.oscillator is not None
    return not stated and bool(eqx.tree_equal(setup.oscillator, usual))


def _surveyed(record: RecordingFile | AbstractRecording, said: Statements) -> Survey:
    oscillator, laws, sensor, fixed, start, free, priors = said
    for name, prior in priors.items():
        check_kind("priors", prior, Normal, "Normal(0.071, 0.001)")
        if name in fixed:
            raise ValueError(f"`{name}` is in both `priors` and `fixed`.")
    free = [*dict.fromkeys([*free, *priors])]
    for law in laws or ():
        check_law(law)
    if oscillator is not None:
        check_kind("oscillator", oscillator, AbstractOscillator, "Pendulum(13.0)")
    file = record if isinstance(record, RecordingFile) else None
    if isinstance(record, RecordingFile):
        setup, name = setup_of(record, oscillator, laws), str(record.path)
        recording, notes = record.recording, list(record.notes)
        chosen = record.sidecar.read.window is not None
        told = _told(record, setup)
    else:
        check_kind("record", record, AbstractRecording, "Recording(ts, values, Angle())")
        recording, notes = _without_outliers(record)
        name, chosen, told = "recording", False, set()
        setup = Setup(oscillator or OSCILLATORS[record.usual_oscillator](), Sensor(), laws=laws)
    own = {name: prior for name, prior in setup.priors.items() if name not in fixed}
    setup = _with_arguments(setup, sensor, fixed, start, free)._replace(priors={**own, **priors})
    setup = with_named_low_pass(recording, setup)
    arguments = {*fixed, *start, *free}
    told |= arguments | ({*WHERE, "cutoff"} if sensor is not None else set())
    if not recording.suits(setup.oscillator):
        kind = type(setup.oscillator).__name__
        raise ValueError(f"A record of {recording.observed} does not suit a {kind}.")
    check_requests(setup, file, arguments)
    recording, look, setup = adjusted(recording, setup, told, chosen, notes)
    return Survey(name, file, recording, look, setup, _why(file, recording, said), tuple(notes))


def _why(file: RecordingFile | None, recording: AbstractRecording, said: Statements) -> str:
    if said.oscillator is not None:
        return "as stated"
    if file is not None and file.sidecar.system.oscillator is not None:
        return "as the sidecar says"
    return f"as usual for {recording.observed}"


def _without_outliers(recording: AbstractRecording) -> tuple[AbstractRecording, list[str]]:
    """The recording without outliers, and the sentence on them; a file's are already left out."""
    wrong = recording.outliers()
    if not wrong.any():
        return recording, []
    said = f"{count_of(wrong, 'sample')} far from those beside, and left out."
    return recording.without(wrong), [said]


def _told(file: RecordingFile, setup: Setup) -> set[str]:
    """Names of the parameters that the sidecar mentions."""
    sidecar = file.sidecar
    filtered = set() if sidecar.sensor.cutoff is None else {"cutoff"}
    named = {*sidecar.start, *sidecar.fixed, *sidecar.priors, *sidecar.fit.free}
    return filtered | named | {*setup.held}


def _with_arguments(
    setup: Setup,
    sensor: Sensor | None,
    fixed: Mapping[str, float | None],
    start: Mapping[str, float],
    free: Sequence[str],
) -> Setup:
    """The setup with the sidecar's statements overridden by the arguments."""
    own_fixed = {name: value for name, value in setup.fixed.items() if name not in {*free, *start}}
    begun = {name: value for name, value in setup.fixed.items() if name in free} | {**setup.start}
    own_start = {name: value for name, value in begun.items() if fixed.get(name) is None}
    own_free = [name for name in setup.free if name not in fixed]
    said = {*fixed, *start, *free}
    values = {name: value for name, value in fixed.items() if value is not None}
    held = [name for name, value in fixed.items() if value is None and name not in own_fixed]
    held += [name for name in setup.held if name not in said]
    return setup._replace(
        oscillator=_with_asked_drag(setup.oscillator, said),
        sensor=setup.sensor if sensor is None else sensor,
        fixed={**own_fixed, **values},
        held=held,
        start={**own_start, **start},
        free=[*dict.fromkeys([*own_free, *free])],
        dry_friction=True if DRY_FRICTION in said else setup.dry_friction,
    )


def _with_asked_drag(oscillator: AbstractOscillator, said: Collection[str]) -> AbstractOscillator:
    """The oscillator with drag, if the user spoke of it and the oscillator may have it."""
    return with_drag(oscillator) if DRAG in said and may_have_drag(oscillator) else oscillator
