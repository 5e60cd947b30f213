"""The verb `prepare`: file or recording → an experiment for each law."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from impactjax._compare.adjust import WHERE, adjusted
from impactjax._compare.laws import LAWS, NO_LAW, USUAL_LAWS
from impactjax._compare.oscillators import (
    DRY_FRICTION,
    OSCILLATORS,
    is_dry,
    may_be_dry,
    with_dry_friction,
    with_known,
)
from impactjax._compare.setup import Setup, setup_of
from impactjax._compare.step_budget import step_budget
from impactjax._compare.typical_systems import Law, parameters, with_law
from impactjax._first_look.first_look import FirstLook
from impactjax._model.law import AbstractLaw
from impactjax._model.oscillator import AbstractOscillator
from impactjax._parameter import ranges
from impactjax._problem.checks import check_known, check_value
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import handles, replaced
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.read_recording import RecordingFile, read_recording
from impactjax._refusal import check_kind
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import Start, System

_FREE_FLIGHT = "free flight"
WITH_DRY_FRICTION = " with dry friction"  # suffix of a model's name


class Prepared(NamedTuple):
    """Experiments on one recording, one for each law.

    - `name`: name of the recording.
    - `experiments`: experiments by the name of their law.
    - `first_look`: first estimates from the recording.
    - `notes`: sentences on samples left out, a sign turned and values assumed.
    """

    name: str
    experiments: dict[str, Experiment]
    first_look: FirstLook
    notes: tuple[str, ...] = ()

    @property
    def experiment(self) -> Experiment:
        """The experiment, if there is only one. Raises `ValueError` if there are several."""
        if len(self.experiments) != 1:
            raise ValueError(f"There are {len(self.experiments)} experiments; take one by name.")
        return next(iter(self.experiments.values()))


def prepare(
    record: str | Path | RecordingFile | AbstractRecording,
    *,
    oscillator: AbstractOscillator | None = None,
    laws: Sequence[Law] | None = None,
    sensor: Sensor | None = None,
    fixed: Mapping[str, float] = {},
    start: Mapping[str, float] = {},
    free: Sequence[str] = (),
) -> Prepared:
    """Experiments for some laws on a recording, as the command `impactjax fit` makes them.

    A first look at the record gives the starting values. Known values come from the sidecar and the
    arguments; an argument overrides the sidecar. In a record of the coordinate, its sign, the
    position of the stop and a hand at the start are detected, unless they are stated.

    **Arguments:**

    - `record`: file, result of `read_recording`, or recording.
    - `oscillator`: oscillator that was recorded; its values are kept where the record shows none.
      By default it follows from the sidecar, or from the recorded quantity.
    - `laws`: names from `LAWS`, "none" for free flight, or laws of your own, which start from their
      own values; by default the usual ones.
    - `sensor`: gain, offset, filter and noise of the instrument.
    - `fixed`: known parameters by name; a law that does not have a parameter ignores it.
    - `start`: starting values by name, instead of those of the first look.
    - `free`: names of parameters to fit although they are usually known.

    **Raises** `FileError` for a file or sidecar that cannot be read, `ValueError` for a name that
    no law has, a value out of range and an oscillator that does not suit the recording.
    """
    for law in laws or ():
        check_law(law)
    if oscillator is not None:
        check_kind("oscillator", oscillator, AbstractOscillator, "Pendulum(13.0)")
    if isinstance(record, str | Path):
        record = read_recording(record)
    if isinstance(record, RecordingFile):
        setup, name = setup_of(record, oscillator, laws), str(record.path)
        recording, notes = record.recording, list(record.notes)
        chosen = record.sidecar.read.window is not None
        said = _said(record)
    else:
        check_kind("record", record, AbstractRecording, "Recording(ts, values, Angle())")
        recording, notes, name, chosen, said = record, [], "recording", False, set()
        setup = Setup(oscillator or OSCILLATORS[record.usual_oscillator](), Sensor(), laws=laws)
    setup = _with_arguments(setup, sensor, fixed, start, free)
    said |= {*fixed, *start, *free} | ({*WHERE} if sensor is not None else set())
    if not recording.suits(setup.oscillator):
        kind = type(setup.oscillator).__name__
        raise ValueError(f"A record of {recording.observed} does not suit a {kind}.")
    _check_names(setup)
    return _prepared(name, recording, setup, said, chosen, notes)


def check_law(law: Law) -> None:
    """Raises `ValueError` for a name that is not in the table, `TypeError` for another type."""
    if isinstance(law, str):
        if law not in (NO_LAW, *LAWS):
            known = ", ".join([NO_LAW, *LAWS])
            raise ValueError(f"There is no law `{law}`; there are {known}.")
    elif not isinstance(law, AbstractLaw):
        raise TypeError(
            f"A law must be a name or an object such as `Restitution(0.7)`, but it is {law!r}."
        )


def name_of(law: Law) -> str:
    """Name of a law in tables: that on the command line, or that of its class."""
    if isinstance(law, str):
        return _FREE_FLIGHT if law == NO_LAW else law
    return type(law).__name__


def _said(file: RecordingFile) -> set[str]:
    """Names of the parameters that the sidecar mentions."""
    sensor = file.sidecar.sensor
    given = {"gain": sensor.gain, "offset": sensor.offset}
    named = {*file.sidecar.start, *file.sidecar.fixed, *file.sidecar.fit.free}
    return named | {name for name, value in given.items() if value is not None}


def _with_arguments(
    setup: Setup,
    sensor: Sensor | None,
    fixed: Mapping[str, float],
    start: Mapping[str, float],
    free: Sequence[str],
) -> Setup:
    """The setup with the sidecar's statements overridden by the arguments."""
    own_fixed = {name: value for name, value in setup.fixed.items() if name not in {*free, *start}}
    own_start = {name: value for name, value in setup.start.items() if name not in fixed}
    own_free = [name for name in setup.free if name not in fixed]
    said = {*fixed, *start, *free}
    return setup._replace(
        sensor=setup.sensor if sensor is None else sensor,
        fixed={**own_fixed, **fixed},
        start={**own_start, **start},
        free=[*dict.fromkeys([*own_free, *free])],
        dry_friction=True if DRY_FRICTION in said else setup.dry_friction,
    )


def _check_names(setup: Setup) -> None:
    """Checks the names and values in a setup; a name may also belong to a law that is not tried."""
    asked = dict.fromkeys([*setup.fixed, *setup.start, *setup.free])
    if not asked:
        return
    known = parameters(setup.oscillator, [NO_LAW, *(setup.laws or USUAL_LAWS)])
    if not known.keys() >= asked.keys():
        known = parameters(setup.oscillator, [NO_LAW, *LAWS]) | known
    for part in (setup.sensor, setup.sensor.low_pass):
        known |= {} if part is None else ranges(part)
    for name in asked:
        check_known(name, known)
        if name in setup.free and name in setup.fixed:
            raise ValueError(f"`{name}` is in both `free` and `fixed`.")
    if "t0" in setup.start:
        raise ValueError("`t0` cannot be started elsewhere: a search starts at the first impact.")
    for name, value in [*setup.fixed.items(), *setup.start.items()]:
        check_value(name, value, known[name])


def _prepared(
    name: str,
    recording: AbstractRecording,
    setup: Setup,
    said: set[str],
    chosen: bool,
    notes: list[str],
) -> Prepared:
    recording, look, setup = adjusted(recording, setup, said, chosen, notes)
    laws = _usual_laws(recording, look) if setup.laws is None else setup.laws
    experiments = {}
    for name_of_law, law in _named(laws).items():
        for dry in _frictions(setup, law):
            own = look._replace(oscillator=_with_friction(look.oscillator, setup, dry))
            called = name_of_law + (WITH_DRY_FRICTION if dry else "")
            experiments[called] = _experiment(recording, own, setup, law)
    return Prepared(name, experiments, look, tuple(notes))


def _named(laws: Sequence[Law]) -> dict[str, Law]:
    """Laws by name; several objects of one class are numbered."""
    found: dict[str, Law] = {}
    for law in laws:
        name, number = name_of(law), 1
        while not isinstance(law, str) and name in found:
            number += 1
            name = f"{name_of(law)} {number}"
        found.setdefault(name, law)
    return found


def _usual_laws(recording: AbstractRecording, look: FirstLook) -> Sequence[Law]:
    """Names of the usual laws; only "none" if the motion is free."""
    free = look.swings_freely and look.elsewhere is None and not recording.observes_impacts
    return [NO_LAW] if free else USUAL_LAWS


def _frictions(setup: Setup, law: Law) -> tuple[bool, ...]:
    """Variants to try for a law: both without and with dry friction in free flight, unless the user
    decided it.
    """
    if DRY_FRICTION in {*setup.fixed, *setup.start, *setup.free}:
        return (True,)
    undecided = setup.dry_friction is None and may_be_dry(setup.oscillator)
    if law == NO_LAW and undecided and not is_dry(setup.oscillator):
        return False, True
    return (bool(setup.dry_friction) or is_dry(setup.oscillator),)


def _with_friction(oscillator: AbstractOscillator, setup: Setup, dry: bool) -> AbstractOscillator:
    return with_known(with_dry_friction(oscillator), setup.fixed) if dry else oscillator


def _experiment(
    recording: AbstractRecording, look: FirstLook, setup: Setup, law: Law
) -> Experiment:
    system = System(with_law(look, law), look.initial, Start(0.0), setup.sensor)
    known = handles(system)
    stated = {name: value for name, value in setup.start.items() if name in known}
    begun = replaced(system, tuple(stated), tuple(stated.values()))
    measured = {
        name: value
        for name, value in stated.items()
        if known[name].allowed.known and name not in setup.free
    }
    fixed = {**measured, **{name: v for name, v in setup.fixed.items() if name in known}}
    model = replaced(begun, tuple(fixed), tuple(fixed.values())).model
    return Experiment(
        begun.model,
        recording,
        begun.initial,
        begun.sensor,
        fixed=fixed,
        free=[name for name in setup.free if name in known],
        simulation=step_budget(recording, look, model),
    )
