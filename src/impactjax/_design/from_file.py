"""The experiments in a plan file."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from impactjax._compare.named import EQUILIBRIA, SEPARATIONS, check_law, check_named
from impactjax._compare.oscillators import OSCILLATORS, with_known
from impactjax._compare.setup import sensor_of
from impactjax._compare.typical_systems import Upper, typical_system
from impactjax._design.candidates import Between, Candidates
from impactjax._design.criterion import (
    AbstractCriterion,
    AOptimal,
    DOptimal,
    Within,
    WorstParameter,
)
from impactjax._model.base_motion import on_base
from impactjax._model.initial_state import InitialState
from impactjax._model.oscillator import AbstractOscillator
from impactjax._problem.build_problem import build_problem
from impactjax._problem.checks import check_known, check_value
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import handles, replaced
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.file_error import FileError
from impactjax._record.plan_file import DURATION, IMPACTS, LENGTHS, RATE, PlanFile, RangeTable
from impactjax._record.planned import planned, planned_impacts
from impactjax._sensor.quantity import QUANTITIES, observables
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import System
from impactjax._types import Scalar

_STATES = {True: ("theta0", "theta_dot0"), False: ("x0", "x_dot0")}  # by "is an angle"
_SPEED = 1.0  # usual one after the first impact [rad/s or m/s]

CRITERIA: dict[str, Callable[..., AbstractCriterion]] = {
    "d-optimal": DOptimal,
    "a-optimal": AOptimal,
    "worst-parameter": WorstParameter,
}


class Planned(NamedTuple):
    """Experiments in a plan.

    - `system`: the system with its values.
    - `experiments`: the recordings of one motion at those values, one for each sensor.
    - `candidates`: the experiments to choose from.
    """

    system: System
    experiments: Sequence[Experiment]
    candidates: Candidates


def planned_experiments(path: Path, plan: PlanFile) -> Planned:
    """The experiments in a plan. Raises `FileError`."""
    try:
        system = _system(plan)
        at = {name: value for name, value in plan.values.items() if name in handles(system)}
        system = replaced(system, tuple(at), tuple(at.values())) if at else system
        _check_names(plan, system)
        if plan.of_impacts:
            _check_impacts(plan, system)
        candidates = Candidates(
            lambda model, **choices: _experiments(
                plan, dataclasses.replace(system, model=model), choices
            ),
            {name: _choice(each) for name, each in plan.choices.items()},
            lambda **choices: _costs(plan, choices),
        )
        experiments = _experiments(plan, system, {})
        for each in experiments:
            build_problem(each)
    except FileError:
        raise
    except ValueError as error:
        raise FileError(path, None, str(error).removesuffix("."), "correct the plan") from error
    return Planned(system, experiments, candidates)


def criterion_of(path: Path, plan: PlanFile) -> AbstractCriterion:
    """The criterion of a plan. Raises `FileError` for an unknown one, or none."""
    if plan.goal:
        return Within(plan.goal)
    if plan.criterion is None:
        remedy = "add a table [goal], as in omega0 = 0.05, or [criterion]"
        raise FileError(path, None, "the plan does not say what is asked for", remedy)
    try:
        check_named("criterion", plan.criterion.name, CRITERIA)
        return CRITERIA[plan.criterion.name](plan.criterion.parameters)
    except ValueError as error:
        raise FileError(path, None, str(error).removesuffix("."), "correct the plan") from error


def _system(plan: PlanFile) -> System:
    name = plan.system.oscillator or ("bouncing-ball" if plan.of_impacts else "pendulum")
    check_named("system", name, OSCILLATORS)
    check_law(plan.system.law)
    oscillator = _oscillator(plan, with_known(OSCILLATORS[name](), plan.values))
    upper = None
    if plan.upper.gap is not None:
        check_law(plan.upper.law or plan.system.law)
        upper = Upper(plan.upper.law, plan.upper.gap)
    separation = None
    if plan.system.separation is not None:
        check_named("rule of separation", plan.system.separation, SEPARATIONS)
        separation = SEPARATIONS[plan.system.separation]
    typical = typical_system(oscillator, plan.system.law, upper, separation)
    typical = dataclasses.replace(typical, sensor=sensor_of(plan.sensor))
    return _after_impact(typical, jnp.asarray(_SPEED)) if plan.of_impacts else typical


def _oscillator(plan: PlanFile, oscillator: AbstractOscillator) -> AbstractOscillator:
    if plan.system.equilibrium is not None:
        check_named("equilibrium", plan.system.equilibrium, EQUILIBRIA)
        if "equilibrium" not in {field.name for field in dataclasses.fields(oscillator)}:
            raise ValueError(f"A {type(oscillator).__name__} has no `equilibrium`.")
        equilibrium = EQUILIBRIA[plan.system.equilibrium]
        oscillator = dataclasses.replace(oscillator, equilibrium=equilibrium)
    motion = plan.base.motion()
    if motion is not None:
        oscillator = on_base(oscillator, motion)
    return oscillator


def _check_names(plan: PlanFile, system: System) -> None:
    """Raises `ValueError` for a name or a value that the system does not have."""
    known = handles(system)
    for name, value in plan.values.items():
        check_known(name, known)
        check_value(name, value, known[name].allowed)
    for name in (*plan.fit.fixed, *plan.fit.free, *plan.goal):
        check_known(name, known)
    for name, choice in plan.choices.items():
        if name in LENGTHS:
            continue
        check_known(name, known)
        ends = [choice.low, choice.high] if isinstance(choice, RangeTable) else choice
        for value in ends:
            check_value(name, value, known[name].allowed)


def _check_impacts(plan: PlanFile, system: System) -> None:
    """Raises `ValueError` for what the motion from a first impact on does not have."""
    if system.model.lower is None:
        raise ValueError("A system without a stop has no impact times.")
    place, speed = _STATES[system.model.oscillator.is_angle()]
    if place in {*plan.values, *plan.choices, *plan.fit.free}:
        raise ValueError(
            f"Impact times begin at the stop, where `{place}` is known; state only `{speed}`, the "
            "velocity after the first impact."
        )
    chosen = plan.choices.get(speed, [plan.values.get(speed, _SPEED)])
    if (chosen.low if isinstance(chosen, RangeTable) else min(chosen)) <= 0:
        raise ValueError(f"`{speed}` must be positive: the mass leaves the stop at first.")


def _experiments(plan: PlanFile, system: System, choices: Mapping[str, float]) -> list[Experiment]:
    """The recordings of one motion, one for each sensor."""
    own = {name: value for name, value in choices.items() if name not in LENGTHS}
    changed = replaced(system, tuple(own), tuple(own.values())) if own else system
    if plan.of_impacts:
        changed = _after_impact(changed, changed.initial.velocity)
    return [
        Experiment(
            changed.model,
            recording,
            changed.initial,
            sensor,
            fixed=plan.fit.fixed,
            free=plan.fit.free,
        )
        for recording, sensor in _recordings(plan, changed, choices)
    ]


def _recordings(
    plan: PlanFile, system: System, choices: Mapping[str, float]
) -> list[tuple[AbstractRecording, Sensor]]:
    """The planned recordings of a motion with their sensors."""
    if plan.of_impacts:
        count = int(plan.length(IMPACTS, choices))
        return [(planned_impacts(system.model, system.initial, count), system.sensor)]
    duration, rate = (plan.length(name, choices) for name in (DURATION, RATE))
    ts = np.arange(round(duration * rate) + 1) / rate
    usual = "angle" if system.model.oscillator.is_angle() else "displacement"
    sensors = [(plan.recording.quantity or usual, system.sensor)]
    sensors += [(each.quantity, sensor_of(each.sensor)) for each in plan.sensors]
    for name, _ in sensors:
        check_named("quantity", name, observables())
    return [(planned(ts, QUANTITIES[name]), sensor) for name, sensor in sensors]


def _after_impact(system: System, velocity: Scalar) -> System:
    """The system at the moment after an impact at its lower stop."""
    lower = system.model.lower
    place = 0.0 if lower is None else -lower.gap
    return dataclasses.replace(system, initial=InitialState(place, velocity))


def _choice(given: list[float] | RangeTable) -> Between | list[float]:
    return Between(given.low, given.high) if isinstance(given, RangeTable) else given


def _costs(plan: PlanFile, choices: Mapping[str, float]) -> dict[str, float]:
    duration = plan.length(DURATION, choices)
    return {name: each.each + each.second * duration for name, each in plan.cost.items()}
