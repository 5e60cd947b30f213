"""The verb `prepare`: file or recording → an experiment for each law."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from impactjax._compare.laws import LAWS, NO_LAW, USUAL_FORCE_LAWS, USUAL_LAWS
from impactjax._compare.oscillators import (
    DRY_FRICTION,
    is_dry,
    may_be_dry,
    with_dry_friction,
    with_known,
)
from impactjax._compare.setup import Setup
from impactjax._compare.step_budget import step_budget
from impactjax._compare.survey import Statements, Survey, survey
from impactjax._compare.typical_systems import Law, takes_separation, with_law
from impactjax._first_look.first_look import FirstLook
from impactjax._model.law import AbstractForceLaw
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.separation import AbstractSeparation, AtZeroForce
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import Handle, handles, replaced
from impactjax._problem.prior import Normal
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.read_recording import RecordingFile
from impactjax._sensor.low_pass import Butterworth
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import Start, System

_FREE_FLIGHT = "free flight"
WITH_DRY_FRICTION = " with dry friction"  # suffix of a model's name
WITHOUT_PULL = " without pull"  # suffix of a law whose contact ends at zero force


class Prepared(NamedTuple):
    """Experiments on one recording, one for each law.

    - `name`: name of the recording.
    - `experiments`: experiments by the name of their law.
    - `first_look`: first estimates from the recording.
    - `notes`: sentences on samples left out, a sign turned and values assumed.
    - `may_rub`: names of the experiments with a stop whose dry friction nobody decided.
    - `possible_low_pass`: low-pass that nobody stated, and that there may be or not. It is tried if
      the residuals without one exceed the noise. `None` if it was stated, or is always fitted.
    """

    name: str
    experiments: dict[str, Experiment]
    first_look: FirstLook
    notes: tuple[str, ...] = ()
    may_rub: frozenset[str] = frozenset()
    possible_low_pass: Butterworth | None = None

    @property
    def experiment(self) -> Experiment:
        """The experiment, if there is only one. Raises `ValueError` if there are several."""
        if len(self.experiments) != 1:
            names = ", ".join(self.experiments)
            raise ValueError(f"There are several experiments, {names}: take one by name.")
        return next(iter(self.experiments.values()))


def prepare(
    record: str | Path | RecordingFile | AbstractRecording,
    *,
    oscillator: AbstractOscillator | None = None,
    laws: Sequence[Law] | None = None,
    sensor: Sensor | None = None,
    fixed: Mapping[str, float | None] = {},
    start: Mapping[str, float] = {},
    free: Sequence[str] = (),
    priors: Mapping[str, Normal] = {},
) -> Prepared:
    """Experiments for some laws on a recording, as the command `impactjax fit` makes them.

    A first look at the record gives the starting values. Known values come from the sidecar and the
    arguments; an argument overrides the sidecar. In a record of the coordinate, its sign, the
    position of the stop and a hand at the start are detected, unless they are stated.

    **Arguments:**

    - `record`: file, result of `read_recording`, or recording.
    - `oscillator`: oscillator that was recorded; its values are kept where the record shows none.
      By default it follows from the sidecar, or from the recorded quantity; a height whose flights
      have the acceleration of gravity is that of a ball.
    - `laws`: names from `LAWS`, "none" for free flight, or laws of your own, which start from their
      own values; by default the usual ones.
    - `sensor`: gain, offset, filter and noise of the instrument.
    - `fixed`: known parameters by name; a law that does not have a parameter ignores it. A value
      `None` holds a parameter where the search would start.
    - `start`: starting values by name, instead of those of the first look.
    - `free`: names of parameters to fit although they are usually known.
    - `priors`: prior knowledge of parameters, by name, which are then fitted; a law that does not
      have a parameter ignores it.

    **Raises** `FileError` for a file or sidecar that cannot be read, `ValueError` for a name that
    no law has, a value out of range and an oscillator that does not suit the recording.
    """
    said = Statements(oscillator, laws, sensor, fixed, start, free, priors)
    return prepared(survey(record, said))


def name_of(law: Law) -> str:
    """Name of a law in tables: that on the command line, or that of its class."""
    if isinstance(law, str):
        return _FREE_FLIGHT if law == NO_LAW else law
    return type(law).__name__


def prepared(found: Survey) -> Prepared:
    """Experiments for the laws of a survey."""
    recording, look, setup = found.recording, found.look, found.setup
    laws = _usual_laws(recording, look) if setup.laws is None else setup.laws
    experiments = {}
    for name_of_law, law in _named(laws).items():
        for dry, separation in itertools.product(
            _frictions(setup, law), _possible_separations(setup, law, look)
        ):
            own = look._replace(oscillator=_with_friction(look.oscillator, setup, dry))
            called = name_of_law + (WITH_DRY_FRICTION if dry else "")
            if setup.separation is None and isinstance(separation, AtZeroForce):
                called += WITHOUT_PULL
            stated = setup._replace(separation=separation)
            experiments[called] = _experiment(recording, own, stated, law)
    notes = [*found.notes, *_separations(setup, experiments)]
    stopped = {name for name, each in experiments.items() if each.model.lower is not None}
    may_rub = frozenset(stopped if _may_rub(setup) else ())
    low_pass = setup.possible_low_pass
    return Prepared(found.name, experiments, look, tuple(notes), may_rub, low_pass)


def _separations(setup: Setup, experiments: Mapping[str, Experiment]) -> list[str]:
    """Sentence on the laws whose contact ends by their own rule, although another was stated."""
    stops = {name: each.model.lower for name, each in experiments.items()}
    other = [
        name
        for name, stop in stops.items()
        if stop is not None
        and isinstance(stop.law, AbstractForceLaw)
        and type(stop.law.separation) is not type(setup.separation)
    ]
    if setup.separation is None or not other:
        return []
    return [f"`separation` does not apply to {', '.join(other)}: the law has its own rule."]


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
    if free:
        return [NO_LAW]
    return USUAL_FORCE_LAWS if look.is_blow or recording.needs_force_law else USUAL_LAWS


def _frictions(setup: Setup, law: Law) -> tuple[bool, ...]:
    """Variants to try for a law: both without and with dry friction in free flight, unless the user
    decided it.
    """
    if DRY_FRICTION in setup.held:  # fixed without a value: as the oscillator has it
        return (is_dry(setup.oscillator),)
    if _names_friction(setup):
        return (True,)
    if law == NO_LAW and _may_rub(setup):
        return False, True
    return (bool(setup.dry_friction) or is_dry(setup.oscillator),)


def _may_rub(setup: Setup) -> bool:
    """True if there may be dry friction, and the user did not decide it."""
    undecided = setup.dry_friction is None and not _names_friction(setup)
    return undecided and may_be_dry(setup.oscillator) and not is_dry(setup.oscillator)


def _names_friction(setup: Setup) -> bool:
    """True if the user named dry friction as a parameter."""
    return DRY_FRICTION in {*setup.fixed, *setup.held, *setup.start, *setup.free}


def _possible_separations(
    setup: Setup, law: Law, look: FirstLook
) -> tuple[AbstractSeparation | None, ...]:
    """Rules of separation to try for a law: its own, and without pull if both are possible and the
    user did not decide it. A recorded motion seldom tells, and the damping depends on it.
    """
    if setup.separation is not None or not isinstance(law, str) or law == NO_LAW:
        return (setup.separation,)
    return (None, AtZeroForce()) if takes_separation(LAWS[law](look)) else (None,)


def _with_friction(oscillator: AbstractOscillator, setup: Setup, dry: bool) -> AbstractOscillator:
    return with_known(with_dry_friction(oscillator), setup.fixed) if dry else oscillator


def _experiment(
    recording: AbstractRecording, look: FirstLook, setup: Setup, law: Law
) -> Experiment:
    model = with_law(look, law, setup.upper, setup.separation)
    system = System(model, look.initial, Start(0.0), setup.sensor)
    known = handles(system)
    stated = _stated(setup, known)
    begun = replaced(system, tuple(stated), tuple(stated.values()))
    measured = {
        name: value
        for name, value in stated.items()
        if known[name].allowed.known and name not in setup.free
    }
    held = {name: float(known[name].get(begun)) for name in setup.held if name in known}
    stated = {name: value for name, value in setup.fixed.items() if name in known}
    fixed = {**measured, **stated, **held}
    model = replaced(begun, tuple(fixed), tuple(fixed.values())).model
    return Experiment(
        begun.model,
        recording,
        begun.initial,
        begun.sensor,
        fixed=fixed,
        free=[name for name in setup.free if name in known],
        priors={name: prior for name, prior in setup.priors.items() if name in known},
        simulation=step_budget(recording, look, model),
    )


def _stated(setup: Setup, known: Mapping[str, Handle]) -> dict[str, float]:
    """The stated starting values; those of parameters that a record seldom tells are the means of
    their priors.
    """
    means = {
        name: float(prior.mean)
        for name, prior in setup.priors.items()
        if name in known and known[name].allowed.known and known[name].allowed.holds(prior.mean)
    }
    return means | {name: value for name, value in setup.start.items() if name in known}
