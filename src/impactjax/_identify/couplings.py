"""The verb `couplings`: what different measurements tell of a contact law."""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._fit.evaluation import answer_at
from impactjax._identify.directions import Sensitivities
from impactjax._identify.experiment_information import information
from impactjax._identify.information import Information, informed
from impactjax._identify.joint_information import joint_information
from impactjax._identify.words import coupling
from impactjax._known import known
from impactjax._model.base_motion import HarmonicMotion, on_base
from impactjax._model.equivalents import ClosedForm
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.law import AbstractForceLaw, AbstractImpactLaw
from impactjax._optimise.linearisation import Vector
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.padding import padded_size
from impactjax._problem.problem import Problem
from impactjax._record.planned import planned
from impactjax._refusal import check_kind
from impactjax._sensor.low_pass import Butterworth
from impactjax._sensor.quantity import Angle, Displacement
from impactjax._sensor.sensor import Sensor
from impactjax._simulate.single_impact import single_impact
from impactjax._types import Numbers, Samples

_MODEL = "ImpactOscillator(Pendulum(13.0), Stop(Walton(1e4, 1e3)))"
_CUTOFF, _SIGMA = 50.0, 3.5e-3  # of the usual sensor [Hz], [rad] or [m]
_SECOND_START = 0.4  # of the first one


class Accuracy(NamedTuple):
    """Standard deviations of what is measured of a contact.

    - `speed`: of the speed after an impact [m/s].
    - `duration`: of the duration of a contact [s].
    - `penetration`: of the deepest penetration of a contact [m].
    - `force`: of the largest force of a contact [N].
    """

    speed: float = 1e-3
    duration: float = 1e-4
    penetration: float = 1e-5
    force: float = 0.1


@dataclasses.dataclass(frozen=True)
class Couplings:
    """Information in different measurements of one motion about a contact law.

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
        width = max(len(name) for name in self.measurements)
        rows = [f"{name:{width}}  {coupling(told)}" for name, told in self.measurements.items()]
        return "\n".join([self.law, *rows])


def couplings(
    model: ImpactOscillator,
    initial: InitialState,
    ts: Numbers,
    *,
    accuracy: Accuracy = Accuracy(),
    sensor: Sensor | None = None,
    forced: HarmonicMotion | None = None,
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

    **Raises** `ValueError` as `information` does, for a model without a lower stop, a motion
    without a complete impact, and an oscillator without a base if `forced` is given.
    """
    check_kind("model", model, ImpactOscillator, _MODEL)
    if model.lower is None:
        raise ValueError("The model has no lower stop, and so no contact law.")
    usual = Sensor(low_pass=Butterworth(_CUTOFF), sigma=_SIGMA) if sensor is None else sensor
    plan = _Plan(jnp.asarray(ts), usual)
    first = plan.recorded(model, initial)
    if not first.speeds.size:
        raise ValueError("The motion has no complete impact, so nothing tells of the contact.")
    contacts = _contacts(first, accuracy)
    second = dataclasses.replace(initial, position=_SECOND_START * initial.position)
    record = first.with_rows()
    found = {"rebound speeds": first.alone(contacts["speed"]), "record": record}
    for name in ("duration", "penetration", "force"):
        if name in contacts:
            found[f"record, {name}s"] = first.with_rows(contacts[name])
    further = plan.recorded(model, second).with_rows()
    found["record from two starts"] = joint_information([record, further])
    if forced is not None:
        shaken = dataclasses.replace(model, oscillator=on_base(model.oscillator, forced))
        found["record with forcing"] = plan.recorded(shaken, initial).with_rows()
    names = tuple(found["rebound speeds"].names)
    told = {name: _about_law(each, names) for name, each in found.items()}
    return Couplings(type(model.lower.law).__name__, told)


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
        return informed(own, self.values[places], rows[:, places])


class _Plan(NamedTuple):
    """Times and sensor of all records."""

    ts: Samples
    sensor: Sensor

    def recorded(self, model: ImpactOscillator, initial: InitialState) -> _Recorded:
        """A motion with the derivatives of its record."""
        quantity = Angle() if model.oscillator.is_angle() else Displacement()
        plan = Experiment(model, planned(self.ts, quantity), initial, self.sensor)
        problem, told = build_problem(plan), information(plan)
        log = known(answer_at(problem.padded(), problem.start, logged=True).impacts)
        rows = np.asarray(told.sensitivities) / np.asarray(told.scale)
        speeds = np.asarray(log.approach_speed)[log.complete & (log.approach_speed > 0)]
        return _Recorded(problem, known(problem.start), rows, speeds)


def _contacts(recorded: _Recorded, accuracy: Accuracy) -> dict[str, Sensitivities]:
    """Derivatives of what is measured of each contact, divided by the noise."""
    count = padded_size(len(recorded.speeds))  # so that motions share a program
    speeds = jnp.asarray(np.resize(recorded.speeds, count))
    found = known(_slopes(recorded.problem, jnp.asarray(recorded.values), speeds))
    sizes = accuracy._asdict()
    return {name: rows[: len(recorded.speeds)] / sizes[name] for name, rows in found.items()}


@eqx.filter_jit
def _slopes(
    problem: Problem, values: Vector, speeds: Float[Array, " impacts"]
) -> dict[str, Sensitivities]:
    """Derivatives of the outcomes of impacts at some speeds, by all parameters."""

    def outcomes(values: Vector) -> dict[str, Float[Array, " impacts"]]:
        system = problem.system_with(values)
        assert system.model.lower is not None
        law, mass = system.model.lower.law, system.model.oscillator.mass
        if isinstance(law, AbstractImpactLaw):
            return {"speed": speeds * law.restitution(speeds)}
        assert isinstance(law, AbstractForceLaw)
        closed = isinstance(law, ClosedForm)
        found = law.equivalents(speeds, mass) if closed else single_impact(law, speeds, mass)
        return {
            "speed": speeds * found.restitution,
            "duration": found.duration,
            "penetration": found.deepest_penetration,
            "force": found.peak_force,
        }

    return jax.jacfwd(outcomes)(values)
