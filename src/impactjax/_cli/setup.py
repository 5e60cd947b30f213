"""From a file with its sidecar to the setup of a fit."""

import difflib
from collections.abc import Sequence

from impactjax._fit.compare import Setup, laws_for
from impactjax._fit.laws import LAWS, NO_LAW
from impactjax._fit.oscillators import OSCILLATORS
from impactjax._measure.file_error import FileError
from impactjax._measure.low_pass import Butterworth
from impactjax._measure.read_recording import File
from impactjax._measure.recording import ImpactTimes
from impactjax._measure.sensor import Sensor
from impactjax._measure.sidecar import line_of

_MOTION = ("omega_n", "zeta", "dry_friction", "length", "mass", "gravity", "gap")
_CONTACT = ("r", "r0", "alpha", "omega0", "gamma")
_START = ("theta0", "theta_dot0", "x0", "x_dot0", "t0")
_PARAMETERS = (*_MOTION, *_CONTACT, *_START)


def setup_of(file: File, system: str | None) -> Setup:
    """What the sidecar and the command line say of the experiment. Raises `FileError`."""
    sidecar = file.sidecar
    named = system or sidecar.system.oscillator
    if named is None:
        named = _usual_oscillator(file)
    if named not in OSCILLATORS:
        raise _in_sidecar(file, "oscillator", f"unknown oscillator `{named}`", list(OSCILLATORS))
    _check_quantity(file, named)
    for table in (sidecar.fixed, sidecar.start):
        for name in table:
            if name not in _PARAMETERS:
                raise _in_sidecar(file, name, f"unknown parameter `{name}`", _PARAMETERS)
    own = sidecar.sensor
    low_pass = None if own.cutoff is None else Butterworth(own.cutoff, order=own.order)
    sensor = Sensor(own.gain, own.offset, own.delay, low_pass)
    dry_friction = True if "dry_friction" in sidecar.fixed else sidecar.system.dry_friction
    return Setup(named, dry_friction, sidecar.fixed, sidecar.start, sensor)


def _usual_oscillator(file: File) -> str:
    if isinstance(file.recording, ImpactTimes):
        return "bouncing-ball"
    return "pendulum" if file.recording.quantity.of_angle else "linear-oscillator"


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
    if is_angle[oscillator] != quantity.of_angle:
        suited = [name for name, angle in is_angle.items() if angle == quantity.of_angle]
        raise FileError(
            file.path,
            None,
            f"a record of {quantity.name} does not suit a {oscillator}",
            f"use {' or '.join(suited)}",
        )


def laws_of(file: File, setup: Setup, laws: Sequence[str] | None) -> list[str]:
    """The laws to fit: asked for, or in the sidecar, or all that apply. Raises `FileError`."""
    if laws:
        return list(dict.fromkeys(laws))
    known = [NO_LAW, *LAWS]
    for law in file.sidecar.system.laws or ():
        if law not in known:
            raise _in_sidecar(file, "laws", f"unknown law `{law}`", known)
    return file.sidecar.system.laws or laws_for(file.recording, setup)


def _in_sidecar(file: File, key: str, problem: str, allowed: Sequence[str]) -> FileError:
    assert file.sidecar_path is not None
    wrong = problem.split("`")[1]
    close = difflib.get_close_matches(wrong, allowed, 1)
    remedy = f"did you mean `{close[0]}`" if close else f"use one of {', '.join(allowed)}"
    line = line_of(file.sidecar_path.read_text(encoding="utf-8"), key)
    return FileError(file.sidecar_path, line, problem, remedy)
