"""The plan of experiments in a TOML file."""

from pathlib import Path
from typing import Annotated

import msgspec

from impactjax._record.file_error import FileError
from impactjax._record.sidecar import BaseTable, SensorTable, UpperTable, check_complete
from impactjax._record.text import read_text
from impactjax._record.toml_tables import Finite, Positive, line_of, tables_in

DURATION, RATE = "duration", "rate"  # choices that change the number of samples
_MOST_SAMPLES = 100_000


class PlannedSystem(msgspec.Struct, forbid_unknown_fields=True):
    """[system]: oscillator and contact law."""

    law: str
    oscillator: str = "pendulum"
    equilibrium: str | None = None
    separation: str | None = None


class PlannedRecording(msgspec.Struct, forbid_unknown_fields=True):
    """[recording]: quantity, duration [s] and sampling rate [Hz]."""

    quantity: str | None = None
    duration: Positive = 1.4
    rate: Positive = 1000.0


class FurtherSensor(msgspec.Struct, forbid_unknown_fields=True):
    """[[sensors]]: a further sensor of the same motion, and its quantity."""

    quantity: str
    sensor: SensorTable


class PlannedFit(msgspec.Struct, forbid_unknown_fields=True):
    """[fit]: parameters that are known, and those to fit although they usually are."""

    fixed: list[str] = msgspec.field(default_factory=list)
    free: list[str] = msgspec.field(default_factory=list)


class RangeTable(msgspec.Struct, forbid_unknown_fields=True):
    """A range of a choice."""

    low: Finite
    high: Finite


class CostTable(msgspec.Struct, forbid_unknown_fields=True):
    """[cost.NAME]: what a performance takes of a resource, and what each recorded second does."""

    each: Annotated[float, msgspec.Meta(ge=0)] = 0.0
    second: Annotated[float, msgspec.Meta(ge=0)] = 0.0


class CriterionTable(msgspec.Struct, forbid_unknown_fields=True):
    """[criterion]: its name and the parameters that count; all of the model if empty."""

    name: str
    parameters: list[str] = msgspec.field(default_factory=list)


class PlanFile(msgspec.Struct, forbid_unknown_fields=True):
    """All tables of a plan."""

    system: PlannedSystem
    values: dict[str, Finite] = msgspec.field(default_factory=dict)
    fit: PlannedFit = msgspec.field(default_factory=PlannedFit)
    upper: UpperTable = msgspec.field(default_factory=UpperTable)
    base: BaseTable = msgspec.field(default_factory=BaseTable)
    sensor: SensorTable = msgspec.field(default_factory=SensorTable)
    sensors: list[FurtherSensor] = msgspec.field(default_factory=list)
    recording: PlannedRecording = msgspec.field(default_factory=PlannedRecording)
    choices: dict[str, list[Finite] | RangeTable] = msgspec.field(default_factory=dict)
    cost: dict[str, CostTable] = msgspec.field(default_factory=dict)
    budget: dict[str, Positive] = msgspec.field(default_factory=dict)
    goal: dict[str, Positive] = msgspec.field(default_factory=dict)
    criterion: CriterionTable | None = None


def read_plan(path: Path) -> PlanFile:
    """A plan. Raises `FileError`."""
    text = read_text(path)
    plan = tables_in(path, text, PlanFile)
    check_complete(path, text, plan.upper, plan.base)
    if any(each.sigma is None for each in (plan.sensor, *(own.sensor for own in plan.sensors))):
        place = line_of(text, "sensor")
        problem = "a plan needs the size of the noise"
        raise FileError(path, place, problem, "state `sigma` under [sensor], in the SI unit")
    if plan.goal and plan.criterion is not None:
        place = line_of(text, "criterion")
        raise FileError(path, place, "there are a goal and a criterion", "omit one of them")
    for name, choice in plan.choices.items():
        place = line_of(text, name)
        if isinstance(choice, RangeTable) and name in (DURATION, RATE):
            remedy = "list some values, as in [0.7, 1.4]"
            raise FileError(path, place, f"`{name}` cannot be chosen in a range", remedy)
        if isinstance(choice, RangeTable) and not choice.low < choice.high:
            problem = f"the range of `{name}` does not rise"
            raise FileError(path, place, problem, "write { low = 0.2, high = 1.2 }")
        if isinstance(choice, list) and not choice:
            raise FileError(path, place, f"`{name}` has no value", "list some, or omit it")
    _check_samples(path, text, plan)
    return plan


def _check_samples(path: Path, text: str, plan: PlanFile) -> None:
    own = {DURATION: plan.recording.duration, RATE: plan.recording.rate}
    most = {}
    for name, value in own.items():
        choice = plan.choices.get(name, [value])
        assert isinstance(choice, list)  # ranges are refused
        if min(choice) <= 0:
            raise FileError(path, line_of(text, name), f"`{name}` must be positive", "correct it")
        most[name] = max(choice)
    count = most[DURATION] * most[RATE]
    if not 1 <= count <= _MOST_SAMPLES:
        problem = f"{DURATION} times {RATE} is {count:.3g} samples"
        remedy = f"have 1 to {_MOST_SAMPLES}"
        raise FileError(path, line_of(text, "recording"), problem, remedy)
