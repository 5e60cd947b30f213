"""Setup of an experiment: all that is known besides the recording, read from a sidecar."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax.numpy as jnp

from impactjax._compare.measured_base import measured_base
from impactjax._compare.named import EQUILIBRIA, SEPARATIONS, check_law, check_named
from impactjax._compare.oscillators import (
    DRAG,
    DRY_FRICTION,
    OSCILLATORS,
    may_have_drag,
    with_drag,
)
from impactjax._compare.said import refused_in_sidecar, sidecar_error
from impactjax._compare.typical_systems import Law, Upper
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.separation import AbstractSeparation
from impactjax._problem.prior import Normal
from impactjax._record.file_error import FileError
from impactjax._record.read_recording import RecordingFile
from impactjax._record.sidecar import SensorTable, Sidecar
from impactjax._sensor.impulse_response import ImpulseResponse
from impactjax._sensor.low_pass import AbstractLowPass, Butterworth, Resonance
from impactjax._sensor.sensor import Sensor

PHASE = "phase"
"""Name of the phase of the base."""


class Setup(NamedTuple):
    """All that is known of an experiment besides its recording.

    - `oscillator`: oscillator that was recorded.
    - `sensor`: gain, offset, filter and noise of the instrument.
    - `order`: order of a low-pass whose cutoff is not known.
    - `dry_friction`: true with dry friction; `None` tries both in free flight.
    - `fixed`: known parameters by name; a law that does not have a parameter ignores it.
    - `held`: names of parameters that keep their starting values.
    - `start`: starting values by name, instead of those of the first look.
    - `free`: names of parameters to fit although they are usually known.
    - `priors`: prior knowledge by name; a law that does not have a parameter ignores it.
    - `laws`: laws to try; `None` if they follow from the recording.
    - `separation`: rule for the end of a contact; `None` for each law's own.
    - `upper`: second stop; none if `None`.
    - `possible_low_pass`: low-pass that nobody stated, and that there may be or not.
    """

    oscillator: AbstractOscillator
    sensor: Sensor
    order: int = 2
    dry_friction: bool | None = None
    fixed: Mapping[str, float] = {}
    held: Sequence[str] = ()
    start: Mapping[str, float] = {}
    free: Sequence[str] = ()
    priors: Mapping[str, Normal] = {}
    laws: Sequence[Law] | None = None
    separation: AbstractSeparation | None = None
    upper: Upper | None = None
    possible_low_pass: Butterworth | None = None

    @property
    def known_low_pass(self) -> AbstractLowPass | None:
        """The sensor's low-pass, if its cutoff is not fitted."""
        return None if "cutoff" in self.free else self.sensor.low_pass


def setup_of(
    file: RecordingFile, oscillator: AbstractOscillator | None, laws: Sequence[Law] | None
) -> Setup:
    """The setup in a file's sidecar; `oscillator` and `laws` override it.

    **Raises** `FileError` for an unknown oscillator, law, rule or equilibrium, and for what the
    oscillator does not have.
    """
    sidecar, system = file.sidecar, file.sidecar.system
    if oscillator is None:
        name = system.oscillator or _usual(file)
        with refused_in_sidecar(file, "oscillator"):
            check_named("oscillator", name, OSCILLATORS)
        oscillator = OSCILLATORS[name]()
    _check_suits(file, oscillator)
    with refused_in_sidecar(file, "sensor"):
        sensor = sensor_of(sidecar.sensor)
    with refused_in_sidecar(file, "laws"):
        for law in system.laws or ():
            check_law(law)
    upper = None
    if sidecar.upper.gap is not None:
        with refused_in_sidecar(file, "law"):
            check_law(sidecar.upper.law or "restitution")
        upper = Upper(sidecar.upper.law, sidecar.upper.gap)
    separation = None
    if system.separation is not None:
        with refused_in_sidecar(file, "separation"):
            check_named("rule of separation", system.separation, SEPARATIONS)
        separation = SEPARATIONS[system.separation]
    asked = DRY_FRICTION in {*sidecar.fixed, *sidecar.fit.free}
    return Setup(
        _completed(oscillator, file),
        sensor,
        order=sidecar.sensor.order,
        dry_friction=True if asked else system.dry_friction,
        fixed={**_stated(file), **sidecar.fixed},
        held=_measured(sidecar),
        start=sidecar.start,
        free=[*dict.fromkeys([*sidecar.fit.free, *sidecar.priors, *_unstated_phase(sidecar)])],
        priors={name: Normal(*known) for name, known in sidecar.priors.items()},
        laws=laws or system.laws,
        separation=separation,
        upper=upper,
    )


def _asks_for_drag(file: RecordingFile) -> bool:
    sidecar = file.sidecar
    return sidecar.system.drag or DRAG in {*sidecar.fixed, *sidecar.start, *sidecar.fit.free}


def _usual(file: RecordingFile) -> str:
    """Name of the usual oscillator of a recording; that of a ball if it can be one and has drag."""
    ball = "bouncing-ball"
    has_drag = _asks_for_drag(file) and file.recording.suits(OSCILLATORS[ball]())
    return ball if has_drag else file.recording.usual_oscillator


def _measured(sidecar: Sidecar) -> list[str]:
    """Names of the sensor's parameters that a sidecar states and does not ask to fit."""
    sensor = sidecar.sensor
    own = {"gain": sensor.gain, "offset": sensor.offset, "drift": sensor.drift}
    other = {*sidecar.start, *sidecar.fixed, *sidecar.fit.free}
    return [name for name, value in own.items() if value is not None and name not in other]


def _unstated_phase(sidecar: Sidecar) -> list[str]:
    """The phase of the base, which is fitted if the base moves and nobody states its phase."""
    moves = sidecar.base.amplitude is not None
    return [PHASE] if moves and sidecar.base.phase is None and PHASE not in sidecar.fixed else []


def _completed(oscillator: AbstractOscillator, file: RecordingFile) -> AbstractOscillator:
    """The oscillator with the equilibrium, the drag and the motion of the base in a sidecar."""
    system, base = file.sidecar.system, file.sidecar.base
    fields = {field.name for field in dataclasses.fields(oscillator)}
    own = type(oscillator).__name__
    if system.equilibrium is not None:
        with refused_in_sidecar(file, "equilibrium"):
            check_named("equilibrium", system.equilibrium, EQUILIBRIA)
        if "equilibrium" not in fields:
            problem = f"a {own} has no `equilibrium`"
            raise sidecar_error(file, "equilibrium", problem, "use it with a pendulum")
        oscillator = dataclasses.replace(oscillator, equilibrium=EQUILIBRIA[system.equilibrium])
    motion = measured_base(file) if base.is_measured else base.motion()
    if motion is not None:
        if "base" not in fields:
            problem = f"the base of a {own} cannot move"
            raise sidecar_error(file, "base", problem, "omit [base], or use another oscillator")
        with refused_in_sidecar(file, "base"):
            oscillator = dataclasses.replace(oscillator, base=motion)
    if _asks_for_drag(file):
        if not may_have_drag(oscillator):
            remedy = "omit it, or use a bouncing-ball"
            raise sidecar_error(file, DRAG, f"a {own} has no drag", remedy)
        with refused_in_sidecar(file, DRAG):
            oscillator = with_drag(oscillator)
    return oscillator


def _stated(file: RecordingFile) -> dict[str, float]:
    """Values in [upper] and [base] of parameters that are not to be fitted."""
    base, gap = file.sidecar.base, file.sidecar.upper.gap
    found = {} if gap is None else {"upper_gap": gap}
    moves = {name: getattr(base, name) for name in ("amplitude", "frequency", "rate", PHASE)}
    found |= {name: value for name, value in moves.items() if value is not None}
    return {name: value for name, value in found.items() if name not in file.sidecar.fit.free}


def sensor_of(own: SensorTable) -> Sensor:
    """The sensor that a file describes."""
    low_pass = None
    if own.cutoff is not None and math.isfinite(own.cutoff):
        low_pass = Butterworth(own.cutoff, order=own.order)
    if own.impulse_response is not None and own.interval is not None:
        low_pass = ImpulseResponse(jnp.asarray(own.impulse_response), own.interval)
    if own.resonance is not None:
        low_pass = Resonance(own.resonance)
        if own.resonance_damping is not None:
            low_pass = Resonance(own.resonance, own.resonance_damping)
    gain, offset, drift = 1.0 if own.gain is None else own.gain, own.offset or 0.0, own.drift or 0.0
    return Sensor(gain, offset, own.delay, drift, low_pass, own.sigma, own.quantisation)


def _check_suits(file: RecordingFile, oscillator: AbstractOscillator) -> None:
    """Raises `FileError` for an angle without a pendulum, or a displacement with one."""
    if file.recording.suits(oscillator):
        return
    suited = [name for name, make in OSCILLATORS.items() if file.recording.suits(make())]
    names = {type(make()): name for name, make in OSCILLATORS.items()}
    own = names.get(type(oscillator), type(oscillator).__name__)
    problem = f"a record of {file.recording.observed} does not suit a {own}"
    raise FileError(file.path, None, problem, f"use {' or '.join(suited)}")
