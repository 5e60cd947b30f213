"""From a file with its sidecar to the task of a fit."""

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._compare.compare import Setup, first_sight, laws_for
from impactjax._compare.laws import LAWS, NO_LAW, USUAL_LAWS
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.typical_systems import parameters
from impactjax._first_look.hand_release import release
from impactjax._parameter import ranges
from impactjax._record.file_error import FileError
from impactjax._record.read_recording import File
from impactjax._record.recording import AnyRecording, ImpactTimes, Recording
from impactjax._record.sidecar import SensorTable, line_of
from impactjax._record.text import read_text
from impactjax._report.units import shown_unit
from impactjax._sensor.impulse_response import ImpulseResponse
from impactjax._sensor.low_pass import Butterworth
from impactjax._sensor.quantity import Angle, ContactForce, Displacement, ProperAcceleration
from impactjax._sensor.sensor import Sensor

_BEYOND = 0.25  # how far to the other side a record may go that lies on one
_WHERE = ("gap", "offset", "gain")  # parameters that say where the stop is in a record


class Task(NamedTuple):
    """A recording to fit, with what is known of it and the laws to try.

    - `notes`: sentences on what was left out of the file.
    """

    path: Path
    recording: AnyRecording
    setup: Setup
    laws: list[str]
    notes: tuple[str, ...]


def task_of(file: File, system: str | None, laws: Sequence[str] | None) -> Task:
    """What the sidecar and the command line ask for. Raises `FileError`."""
    setup = _setup(file, system, laws)
    notes = list(file.notes)
    recording = file.recording
    if isinstance(recording, Recording) and isinstance(recording.quantity, Angle | Displacement):
        if not _said(file) & {*_WHERE, "theta0", "x0"}:
            recording = _turned(recording, setup, notes)
        if not _said(file) & {*_WHERE}:
            setup = _placed(recording, setup, notes)
    recording, setup = _released(recording, setup, file.sidecar.read.window is not None, notes)
    return Task(file.path, recording, setup, _laws(file, recording, setup, laws), tuple(notes))


def _said(file: File) -> set[str]:
    """The parameters of which the sidecar says anything."""
    sensor = file.sidecar.sensor
    given = {"gain": sensor.gain, "offset": sensor.offset}
    named = {*file.sidecar.start, *file.sidecar.fixed, *file.sidecar.fit.free}
    return named | {name for name, value in given.items() if value is not None}


def _turned(recording: Recording, setup: Setup, notes: list[str]) -> Recording:
    """The recording, with its sign turned if it lies on the wrong side of the stop."""
    values = np.asarray(recording.values)[np.asarray(recording.valid)]
    turned = eqx.tree_at(lambda each: each.values, recording, -np.asarray(recording.values))
    wrong = float(values.max()) < _BEYOND * abs(float(values.min()))
    if not wrong or first_sight(turned, setup).swings_freely:
        return recording
    notes.append(
        "The record lies on the far side of the stop, so its sign is turned: places count from the "
        "stop towards the free side (`gain = 1` under [sensor] keeps the sign)."
    )
    return turned


def _placed(recording: Recording, setup: Setup, notes: list[str]) -> Setup:
    """Where the stop is, to be found if the record shows that it is not where it is taken to be."""
    place = first_sight(recording, setup).elsewhere
    if place is None:
        return setup
    unit, factor = shown_unit(recording)
    if setup.oscillator in ("pendulum", "linear-oscillator"):
        free, start, said = ("gap", "offset"), {"gap": -place}, "`gap` and `offset` are"
    else:
        free, start, said = ("offset",), {"offset": place}, "`offset` is"
    notes.append(
        f"The impacts seem to be at {place * factor:.3g} {unit}, not at 0: {said} fitted as well "
        "(state `gap` under [fixed], or `offset` under [sensor], if it is known)."
    )
    return setup._replace(free=(*setup.free, *free), start={**setup.start, **start})


def _released(
    recording: AnyRecording, setup: Setup, chosen: bool, notes: list[str]
) -> tuple[AnyRecording, Setup]:
    """The recording from where a hand lets go, unless the sidecar says which part to use.

    What an accelerometer shows to be dropped starts from rest, which nothing else in its record
    could tell.
    """
    if chosen or not isinstance(recording, Recording):
        return recording, setup
    free = release(recording, first_sight(recording, setup))
    if free is None:
        return recording, setup
    begin, end = free
    note = (
        f"A hand seems to hold or push at first: only {begin:.3f} to {end:.3f} s is fitted "
        "(`window` under [read] in the sidecar decides otherwise)."
    )
    dropped = isinstance(recording.quantity, ProperAcceleration)
    if dropped and "x_dot0" not in {*setup.start, *setup.fixed, *setup.free}:
        setup = setup._replace(fixed={**setup.fixed, "x_dot0": 0.0})
        note = f"{note} It is taken to fall from rest."
    notes.append(note)
    return recording.between(begin, end), setup


def _setup(file: File, system: str | None, laws: Sequence[str] | None) -> Setup:
    sidecar = file.sidecar
    named = system or sidecar.system.oscillator
    if named is None:
        named = _usual_oscillator(file)
    if named not in OSCILLATORS:
        raise _in_sidecar(file, "oscillator", f"unknown oscillator `{named}`", list(OSCILLATORS))
    _check_quantity(file, named)
    try:
        sensor = _sensor(sidecar.sensor)
    except ValueError as error:
        problem = str(error).removesuffix(".")
        raise FileError(_sidecar(file), None, problem, "correct it") from error
    _check_values(file, named, sensor, laws)
    asked = "dry_friction" in {*sidecar.fixed, *sidecar.fit.free}
    dry_friction = True if asked else sidecar.system.dry_friction
    return Setup(named, dry_friction, sidecar.fixed, sidecar.start, sidecar.fit.free, sensor)


def _sensor(own: SensorTable) -> Sensor:
    low_pass = None
    if own.cutoff is not None:
        low_pass = Butterworth(own.cutoff, order=own.order)
    if own.impulse_response is not None and own.interval is not None:
        low_pass = ImpulseResponse(jnp.asarray(own.impulse_response), own.interval)
    gain, offset = 1.0 if own.gain is None else own.gain, own.offset or 0.0
    return Sensor(gain, offset, own.delay, own.drift, low_pass, own.sigma, own.quantisation)


def _usual_oscillator(file: File) -> str:
    if isinstance(file.recording, ImpactTimes):
        return "bouncing-ball"
    quantity = file.recording.quantity
    if isinstance(quantity, ProperAcceleration | ContactForce):
        return "bouncing-ball"
    return "pendulum" if quantity.of_angle else "linear-oscillator"


def _check_quantity(file: File, oscillator: str) -> None:
    """An angle needs a pendulum, a displacement something that moves on a line."""
    if isinstance(file.recording, ImpactTimes):
        if oscillator != "bouncing-ball":
            raise FileError(
                file.path, None, f"impact times do not suit a {oscillator}", "use bouncing-ball"
            )
        return
    quantity = file.recording.quantity
    is_angle = {name: make({}, False).is_angle() for name, make in OSCILLATORS.items()}
    if quantity.of_angle is not None and is_angle[oscillator] != quantity.of_angle:
        suited = [name for name, angle in is_angle.items() if angle == quantity.of_angle]
        raise FileError(
            file.path,
            None,
            f"a record of {quantity.name} does not suit a {oscillator}",
            f"use {' or '.join(suited)}",
        )


def _check_values(file: File, oscillator: str, sensor: Sensor, laws: Sequence[str] | None) -> None:
    """Checks what is fixed, what is free and where to start, for all laws to be tried."""
    given, free = {**file.sidecar.start, **file.sidecar.fixed}, file.sidecar.fit.free
    tried = laws or file.sidecar.system.laws or USUAL_LAWS
    tried = [law for law in tried if law in LAWS]
    known = parameters(oscillator, [NO_LAW, *tried]) if given or free else {}
    if not known.keys() >= {*given, *free}:
        known = parameters(oscillator, [NO_LAW, *LAWS]) | known
    of_sensor = [ranges(part) for part in (sensor, sensor.low_pass) if part is not None]
    for name in free:
        if name not in known and not any(name in each for each in of_sensor):
            allowed = [*known, *(each for part in of_sensor for each in part)]
            raise _in_sidecar(file, "free", f"unknown parameter `{name}`", allowed)
        if name in file.sidecar.fixed:
            problem = f"`{name}` is both free and fixed"
            raise FileError(_sidecar(file), _line(file, "free"), problem, "choose one of the two")
    for name, value in given.items():
        if name not in known:
            raise _in_sidecar(file, name, f"unknown parameter `{name}`", list(known))
        if not known[name].holds(jnp.asarray(value)):
            problem = f"`{name}` must be {known[name].describe()}"
            raise FileError(_sidecar(file), _line(file, name), problem, "correct its value")


def _laws(
    file: File, recording: AnyRecording, setup: Setup, laws: Sequence[str] | None
) -> list[str]:
    """The laws asked for, or those in the sidecar, or the usual ones that apply."""
    if laws:
        return list(dict.fromkeys(laws))
    known = [NO_LAW, *LAWS]
    for law in file.sidecar.system.laws or ():
        if law not in known:
            raise _in_sidecar(file, "laws", f"unknown law `{law}`", known)
    return file.sidecar.system.laws or laws_for(recording, setup)


def _in_sidecar(file: File, key: str, problem: str, allowed: Sequence[str]) -> FileError:
    wrong = problem.split("`")[1]
    close = difflib.get_close_matches(wrong, allowed, 1)
    remedy = f"did you mean `{close[0]}`" if close else f"use one of {', '.join(allowed)}"
    return FileError(_sidecar(file), _line(file, key), problem, remedy)


def _sidecar(file: File) -> Path:
    assert file.sidecar_path is not None
    return file.sidecar_path


def _line(file: File, key: str) -> int | None:
    return line_of(read_text(_sidecar(file)), key)
