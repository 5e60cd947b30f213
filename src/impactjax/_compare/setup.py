"""Setup of an experiment: all that is known besides the recording, read from a sidecar."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp

from impactjax._compare.laws import LAWS, NO_LAW, USUAL_LAWS
from impactjax._compare.oscillators import DRY_FRICTION, OSCILLATORS
from impactjax._compare.typical_systems import Law, parameters
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import ranges
from impactjax._record.file_error import FileError
from impactjax._record.read_recording import RecordingFile
from impactjax._record.sidecar import SensorTable, line_of
from impactjax._record.text import read_text
from impactjax._sensor.impulse_response import ImpulseResponse
from impactjax._sensor.low_pass import Butterworth
from impactjax._sensor.sensor import Sensor


class Setup(NamedTuple):
    """All that is known of an experiment besides its recording.

    - `oscillator`: oscillator that was recorded.
    - `sensor`: gain, offset, filter and noise of the instrument.
    - `dry_friction`: true with dry friction; `None` tries both in free flight.
    - `fixed`: known parameters by name; a law that does not have a parameter ignores it.
    - `start`: starting values by name, instead of those of the first look.
    - `free`: names of parameters to fit although they are usually known.
    - `laws`: laws to try; `None` if they follow from the recording.
    """

    oscillator: AbstractOscillator
    sensor: Sensor
    dry_friction: bool | None = None
    fixed: Mapping[str, float] = {}
    start: Mapping[str, float] = {}
    free: Sequence[str] = ()
    laws: Sequence[Law] | None = None


def setup_of(
    file: RecordingFile, oscillator: AbstractOscillator | None, laws: Sequence[Law] | None
) -> Setup:
    """The setup in a file's sidecar; `oscillator` and `laws` override it.

    **Raises** `FileError` for unknown names and values out of range.
    """
    sidecar = file.sidecar
    if oscillator is None:
        name = sidecar.system.oscillator or file.recording.usual_oscillator
        if name not in OSCILLATORS:
            raise _wrong_name(file, "oscillator", f"unknown oscillator `{name}`", [*OSCILLATORS])
        oscillator = OSCILLATORS[name]()
    _check_suits(file, oscillator)
    try:
        sensor = _sensor(sidecar.sensor)
    except ValueError as error:
        problem = str(error).removesuffix(".")
        raise FileError(_sidecar(file), None, problem, "correct it") from error
    for law in sidecar.system.laws or ():
        if law not in (NO_LAW, *LAWS):
            raise _wrong_name(file, "laws", f"unknown law `{law}`", [NO_LAW, *LAWS])
    laws = laws or sidecar.system.laws
    _check_values(file, oscillator, sensor, laws or USUAL_LAWS)
    asked = DRY_FRICTION in {*sidecar.fixed, *sidecar.fit.free}
    dry_friction = True if asked else sidecar.system.dry_friction
    free = sidecar.fit.free
    return Setup(oscillator, sensor, dry_friction, sidecar.fixed, sidecar.start, free, laws)


def _sensor(own: SensorTable) -> Sensor:
    low_pass = None
    if own.cutoff is not None:
        low_pass = Butterworth(own.cutoff, order=own.order)
    if own.impulse_response is not None and own.interval is not None:
        low_pass = ImpulseResponse(jnp.asarray(own.impulse_response), own.interval)
    gain, offset = 1.0 if own.gain is None else own.gain, own.offset or 0.0
    return Sensor(gain, offset, own.delay, own.drift, low_pass, own.sigma, own.quantisation)


def _check_suits(file: RecordingFile, oscillator: AbstractOscillator) -> None:
    """Raises `FileError` for an angle without a pendulum, or a displacement with one."""
    if file.recording.suits(oscillator):
        return
    suited = [name for name, make in OSCILLATORS.items() if file.recording.suits(make())]
    names = {type(make()): name for name, make in OSCILLATORS.items()}
    own = names.get(type(oscillator), type(oscillator).__name__)
    problem = f"a record of {file.recording.observed} does not suit a {own}"
    raise FileError(file.path, None, problem, f"use {' or '.join(suited)}")


def _check_values(
    file: RecordingFile, oscillator: AbstractOscillator, sensor: Sensor, tried: Sequence[Law]
) -> None:
    """Checks that each name in [fixed], [start] and `free` exists for some law, and that its value
    is in range.
    """
    given, free = {**file.sidecar.start, **file.sidecar.fixed}, file.sidecar.fit.free
    known = parameters(oscillator, [NO_LAW, *tried]) if given or free else {}
    if not known.keys() >= {*given, *free}:
        known = parameters(oscillator, [NO_LAW, *LAWS]) | known
    of_sensor = [ranges(part) for part in (sensor, sensor.low_pass) if part is not None]
    for name in free:
        if name not in known and not any(name in each for each in of_sensor):
            allowed = [*known, *(each for part in of_sensor for each in part)]
            raise _wrong_name(file, "free", f"unknown parameter `{name}`", allowed)
        if name in file.sidecar.fixed:
            problem = f"`{name}` is both free and fixed"
            raise FileError(_sidecar(file), _line(file, "free"), problem, "choose one of the two")
    for name, value in given.items():
        if name not in known:
            raise _wrong_name(file, name, f"unknown parameter `{name}`", list(known))
        if not known[name].holds(jnp.asarray(value)):
            problem = f"`{name}` must be {known[name].describe()}"
            raise FileError(_sidecar(file), _line(file, name), problem, "correct its value")


def _wrong_name(file: RecordingFile, key: str, problem: str, allowed: Sequence[str]) -> FileError:
    wrong = problem.split("`")[1]
    close = difflib.get_close_matches(wrong, allowed, 1)
    remedy = f"did you mean `{close[0]}`" if close else f"use one of {', '.join(allowed)}"
    return FileError(_sidecar(file), _line(file, key), problem, remedy)


def _sidecar(file: RecordingFile) -> Path:
    assert file.sidecar_path is not None
    return file.sidecar_path


def _line(file: RecordingFile, key: str) -> int | None:
    return line_of(read_text(_sidecar(file)), key)
