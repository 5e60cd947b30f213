"""The verb `couplings`: what different measurements tell of a contact law."""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._fit.evaluation import answer_at
from impactjax._identify.contact_outcomes import Accuracy, beyond_integration, contact_rows
from impactjax._identify.directions import Sensitivities
from impactjax._identify.experiment_information import information
from impactjax._identify.information import Information, informed
from impactjax._identify.joint_information import joint_information
from impactjax._identify.words import findings, percent
from impactjax._known import known
from impactjax._model.base_motion import HarmonicMotion, on_base, or_at_rest
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.oscillator import AbstractOscillator
from impactjax._optimise.linearisation import Vector
from impactjax._parameter import as_parameter
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem
from impactjax._record.planned import planned
from impactjax._refusal import check_kind
from impactjax._sensor.low_pass import Butterworth
from impactjax._sensor.quantity import Angle, Displacement
from impactjax._sensor.sensor import Sensor
from impactjax._simulate.simulation import Simulation
from impactjax._types import Numbers, Samples

_MODEL = "ImpactOscillator(Pendulum(13.0), Stop(Walton(1e4, 1e3)))"
_CUTOFF, _SIGMA = 50.0, 3.5e-3  # of the usual sensor [Hz], [rad] or [m]
_SECOND_START = 0.4  # of the first one
OPEN = 10.0  # relative bounds from here on count as infinite


@dataclasses.dataclass(frozen=True)
class Couplings:
    """Information in different measurements of one motion about a contact law.

    It prints as a table: relative bounds of the parameters by measurement, with a dash for one that
    the measurement does not determine, and the combinations that are determined better than their
    parameters, or not at all.

    - `law`: name of the law's class.
    - `measurements`: information by measurement; only the law's parameters are `of_model`, those of
      oscillator and initial state are estimated as well.
    """

    law: str
    measurements: Mapping[str, Information]

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters of the law."""
        return _own(next(iter(self.measurements.values())))

    @property
    def bounds(self) -> dict[str, Float[np.ndarray, " parameters"]]:
        """Relative Cramér-Rao bounds of the law's parameters, by measurement [1]."""
        found = {}
        for name, told in self.measurements.items():
            own = [told.names.index(each) for each in _own(told)]
            values, bounds = (np.asarray(x)[own] for x in (told.values, told.bounds))
            sizes = np.where(values != 0, np.abs(values), np.nan)
            found[name] = np.where(values != 0, bounds / sizes, np.inf)
        return found

    def __str__(self) -> str:
        rows = [[self.law, *self.names, "combinations"]]
        for name, bounds in self.bounds.items():
            rows.append([name, *map(_shown, bounds), _combinations(self.measurements[name])])
        if not any(row[-1] for row in rows[1:]):
            rows = [row[:-1] for row in rows]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return "\n".join(
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        )


def _shown(bound: float) -> str:
    return percent(bound) if bound < OPEN else "-"


def _combinations(told: Information) -> str:
    """Findings about more than one parameter."""
    several = [each for each in findings(told) if each.combination not in told.names]
    return "; ".join(
        f"{each.combination} {each.amount}" if each.determined else f"not {each.combination}"
        for each in several
    )


def couplings(
    model: ImpactOscillator,
    initial: InitialState,
    ts: Numbers,
    *,
    accuracy: Accuracy = Accuracy(),
    sensor: Sensor | None = None,
    forced: HarmonicMotion | None = None,
    simulation: Simulation = Simulation(),
) -> Couplings:
    """Information about the contact law in different measurements of a motion:

    - rebound speeds of its impacts;
    - a record of the coordinate at `ts`;
    - the record with durations, deepest penetrations or largest forces of the contacts, for a law
      that has a force;
    - two records, the second from a start at 0.4 times the first one;
    - if `forced` is given, a record on a base that moves.

    The parameters of oscillator and initial state are estimated from the same data. Speeds,
    durations, penetrations and forces are those of impacts at known approach speeds, if nothing but
    the contact acts.

    **Arguments:**

    - `model`, `initial`: model with a lower stop, and initial state.
    - `ts`: times of the samples [s].
    - `accuracy`: standard deviations of what is measured of a contact.
    - `sensor`: sensor of the record, with its `sigma`; by default one with a low-pass of 50 Hz and
      noise of 3.5 mrad (0.2 deg) or 3.5 mm.
    - `forced`: motion of the base, for an oscillator that has one.
    - `simulation`: settings of the simulations of the records.

    **Raises** `ValueError` as `information` does, for a model without a lower stop, a motion
    without a complete impact, an accuracy that is not positive, and an oscillator without a base if
    `forced` is given.
    """
    _check(model, accuracy, sensor, forced, simulation)
    accuracy.check()
    law = None if model.lower is None else model.lower.law
    if law is None:
        raise ValueError("The model has no lower stop, and so no contact law.")
    usual = Sensor(low_pass=Butterworth(_CUTOFF), sigma=_SIGMA) if sensor is None else sensor
    plan, shaken = _Plan(as_parameter(ts), usual, simulation), model
    if forced is not None:
        shaken = _with(model, on_base(model.oscillator, forced))
        model = _with(model, or_at_rest(model.oscillator, forced))  # one program for all records
    first = plan.recorded(model, initial)
    if not first.speeds.size:
        raise ValueError("The motion has no complete impact, so nothing tells of the contact.")
    contacts = contact_rows(first.problem, first.values, first.speeds, accuracy)
    second = dataclasses.replace(initial, position=_SECOND_START * initial.position)
    record = first.with_rows()
    found = {"rebound speeds": first.alone(contacts["speed"]), "record": record}
    for name in ("duration", "penetration", "force"):
        if name in contacts:
            found[f"record, {name}s"] = first.with_rows(contacts[name])
    further = plan.recorded(model, second).with_rows()
    found["record from two starts"] = joint_information([record, further])
    if forced is not None:
        found["record with forcing"] = plan.recorded(shaken, initial).with_rows()
    names = tuple(found["rebound speeds"].names)
    told = {name: _about_law(each, names) for name, each in found.items()}
    return Couplings(type(law).__name__, told)


def _check(
    model: object, accuracy: object, sensor: object, forced: object, simulation: object
) -> None:
    """Raises `TypeError` for an argument of a wrong kind."""
    check_kind("model", model, ImpactOscillator, _MODEL)
    check_kind("accuracy", accuracy, Accuracy, "Accuracy(speed=1e-3)")
    if sensor is not None:
        check_kind("sensor", sensor, Sensor, "Sensor(sigma=3.5e-3)")
    if forced is not None:
        check_kind("forced", forced, HarmonicMotion, "HarmonicMotion(0.01, 26.4)")
    check_kind("simulation", simulation, Simulation, "Simulation(max_steps=1024)")


def _with(model: ImpactOscillator, oscillator: AbstractOscillator) -> ImpactOscillator:
    return dataclasses.replace(model, oscillator=oscillator)


def _about_law(told: Information, names: tuple[str, ...]) -> Information:
    """The information in which only the law's parameters are not accompanying ones."""
    return dataclasses.replace(told, of_model=tuple(name in names for name in told.names))


def _own(told: Information) -> tuple[str, ...]:
    return tuple(name for name, own in zip(told.names, told.of_model, strict=True) if own)


class _Recorded(NamedTuple):
    """A recorded motion.

    - `problem`, `values`: all parameters, and their values.
    - `rows`: derivatives of the samples, divided by their noise.
    - `speeds`: approach speeds of the complete impacts.
    """

    problem: Problem
    values: Vector
    rows: Sensitivities
    speeds: Float[np.ndarray, " impacts"]

    def with_rows(self, *more: Sensitivities) -> Information:
        """Information in the record, and in more measurements."""
        rows = np.concatenate([self.rows, *more])
        return informed(self.problem.handles(), self.values, rows)

    def alone(self, rows: Sensitivities) -> Information:
        """Information in measurements that depend on nothing but the law."""
        handles = self.problem.handles()
        law = ("model", "lower", "law")
        own = {name: handle for name, handle in handles.items() if handle.path[:3] == law}
        places = [self.problem.names.index(name) for name in own]
        values = self.values[places]
        return informed(own, values, beyond_integration(rows[:, places], values))


class _Plan(NamedTuple):
    """Times, sensor and simulation of all records."""

    ts: Samples
    sensor: Sensor
    simulation: Simulation

    def recorded(self, model: ImpactOscillator, initial: InitialState) -> _Recorded:
        """A motion with the derivatives of its record."""
        quantity = Angle() if model.oscillator.is_angle() else Displacement()
        recording = planned(self.ts, quantity)
        plan = Experiment(model, recording, initial, self.sensor, simulation=self.simulation)
        problem, told = build_problem(plan), information(plan)
        log = known(answer_at(problem.padded(), problem.start, logged=True).impacts)
        rows = np.asarray(told.sensitivities) / np.asarray(told.scale)
        speeds = np.asarray(log.approach_speed)[log.complete & (log.approach_speed > 0)]
        return _Recorded(problem, known(problem.start), rows, speeds)
