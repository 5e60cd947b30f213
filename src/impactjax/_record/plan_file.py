"""The plan of experiments in a TOML file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import msgspec

from impactjax._record.file_error import FileError
from impactjax._record.sidecar import BaseTable, SensorTable, UpperTable, check_complete
from impactjax._record.text import read_text
from impactjax._record.toml_tables import LARGEST, Finite, Positive, line_of, tables_in
from impactjax._sensor.quantity import IMPACT_TIME

DURATION, RATE, IMPACTS = "duration", "rate", "impacts"
LENGTHS = (DURATION, RATE, IMPACTS)  # choices of the length of a recording
_USUAL = {DURATION: 1.4, RATE: 1000.0, IMPACTS: 12.0}
_MOST_SAMPLES, _MOST_IMPACTS = 100_000, 400


class PlannedSystem(msgspec.Struct, forbid_unknown_fields=True):
    """[system]: oscillator and contact law, and the scatter of its restitution."""

    law: str
    oscillator: str | None = None
    equilibrium: str | None = None
    separation: str | None = None
    scatter: Annotated[float, msgspec.Meta(ge=0, le=LARGEST)] = 0.0


class PlannedRecording(msgspec.Struct, forbid_unknown_fields=True):
    """[recording]: quantity, and duration [s] and sampling rate [Hz], or number of impacts."""

    quantity: str | None = None
    duration: Positive | None = None
    rate: Positive | None = None
    impacts: Annotated[int, msgspec.Meta(ge=2, le=_MOST_IMPACTS)] | None = None


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

    @property
    def of_impacts(self) -> bool:
        """True if the times of impacts are recorded."""
        return self.recording.quantity == IMPACT_TIME

    def length(self, name: str, choices: Mapping[str, float]) -> float:
        """The duration, the rate or the number of impacts: chosen, stated or usual."""
        stated = getattr(self.recording, name)
        return choices.get(name, _USUAL[name] if stated is None else stated)


def read_plan(path: Path) -> PlanFile:
    """A plan. Raises `FileError`."""
    text = read_text(path)
    plan = tables_in(path, text, PlanFile)
    check_complete(path, text, plan.upper, plan.base)
    if plan.base.is_measured:
        place, remedy = line_of(text, "base"), "give `amplitude` and `frequency` under [base]"
        raise FileError(path, place, "a plan has no measured motion of the base", remedy)
    if plan.base.rate is not None:
        place, remedy = line_of(text, "rate", "base"), "omit `rate` under [base]"
        raise FileError(path, place, "a plan has no sweep of the frequency", remedy)
    if any(each.sigma is None for each in (plan.sensor, *(own.sensor for own in plan.sensors))):
        place = line_of(text, "sensor")
        problem = "a plan needs the size of the noise"
        raise FileError(path, place, problem, "state `sigma` under [sensor], in the SI unit")
    if plan.goal and plan.criterion is not None:
        place = line_of(text, "criterion")
        raise FileError(path, place, "there are a goal and a criterion", "omit one of them")
    for name, choice in plan.choices.items():
        place = line_of(text, name, "choices")
        if isinstance(choice, RangeTable) and name in LENGTHS:
            remedy = f"list some values, as in [{_USUAL[name]:g}]"
            raise FileError(path, place, f"`{name}` cannot be chosen in a range", remedy)
        if isinstance(choice, RangeTable) and not choice.low < choice.high:
            problem = f"the range of `{name}` does not rise"
            raise FileError(path, place, problem, "write { low = 0.2, high = 1.2 }")
        if isinstance(choice, list) and not choice:
            raise FileError(path, place, f"`{name}` has no value", "list some, or omit it")
    (_check_impacts if plan.of_impacts else _check_samples)(path, text, plan)
    return plan


def _check_samples(path: Path, text: str, plan: PlanFile) -> None:
    if plan.recording.impacts is not None or IMPACTS in plan.choices:
        remedy = f'state quantity = "{IMPACT_TIME}" under [recording]'
        raise FileError(path, line_of(text, IMPACTS), "samples have no number of impacts", remedy)
    if any(each.quantity == IMPACT_TIME for each in plan.sensors):
        remedy = "plan them in another file"
        raise FileError(path, None, "impact times are recorded alone", remedy)
    most = {name: max(_lengths(path, text, plan, name)) for name in (DURATION, RATE)}
    count = most[DURATION] * most[RATE]
    if not 1 <= count <= _MOST_SAMPLES:
        problem = f"{DURATION} times {RATE} is {count:.3g} samples"
        remedy = f"have 1 to {_MOST_SAMPLES}"
        raise FileError(path, line_of(text, "recording"), problem, remedy)


def _check_impacts(path: Path, text: str, plan: PlanFile) -> None:
    for name in (DURATION, RATE):
        if getattr(plan.recording, name) is not None or name in plan.choices:
            remedy = f"state `{IMPACTS}`, their number"
            raise FileError(path, line_of(text, name), f"impact times have no `{name}`", remedy)
    if plan.sensors:
        raise FileError(path, None, "impact times are recorded alone", "omit [[sensors]]")
    if any(each.second for each in plan.cost.values()):
        place, problem = line_of(text, "second"), "impact times have no duration that may cost"
        raise FileError(path, place, problem, "state `each`, the cost of a performance")
    for count in _lengths(path, text, plan, IMPACTS):
        if count != round(count) or not 2 <= count <= _MOST_IMPACTS:
            problem, remedy = f"`{IMPACTS}` cannot be {count:g}", f"have 2 to {_MOST_IMPACTS}"
            raise FileError(path, _length_line(text, plan, IMPACTS), problem, remedy)


def _lengths(path: Path, text: str, plan: PlanFile, name: str) -> list[float]:
    """The values that the duration, the rate or the number of impacts may have."""
    choice = plan.choices.get(name, [plan.length(name, {})])
    assert isinstance(choice, list)  # ranges are refused
    if min(choice) <= 0:
        place = _length_line(text, plan, name)
        raise FileError(path, place, f"`{name}` must be positive", "correct it")
    return choice


def _length_line(text: str, plan: PlanFile, name: str) -> int | None:
    """The line that says the duration, the rate or the number of impacts."""
    return line_of(text, name, "choices" if name in plan.choices else "recording")
