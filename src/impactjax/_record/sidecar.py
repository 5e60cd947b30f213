"""The sidecar NAME.toml beside a recording: information that the recording itself lacks."""

import difflib
import re
import sys
import tomllib
from pathlib import Path
from typing import Annotated, Any

import msgspec

from impactjax._record.file_error import FileError
from impactjax._record.text import read_text
from impactjax._sensor.quantity import TIME, observables, units_of

_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "float | null": "a number",
    "str | null": "a text",
    "bool | null": "true or false",
    "array | null": "a list",
    "int | str | null": "a whole number or a text",
}
_LARGEST = sys.float_info.max
Finite = Annotated[float, msgspec.Meta(ge=-_LARGEST, le=_LARGEST)]
Positive = Annotated[float, msgspec.Meta(gt=0, le=_LARGEST)]


class SystemTable(msgspec.Struct, forbid_unknown_fields=True):
    """[system]: oscillator, contact laws, friction and drag."""

    oscillator: str | None = None
    laws: list[str] | None = None
    dry_friction: bool | None = None
    drag: bool = False
    separation: str | None = None
    equilibrium: str | None = None


class UpperTable(msgspec.Struct, forbid_unknown_fields=True):
    """[upper]: position of a second stop, and its law if that is another."""

    gap: Positive | None = None
    law: str | None = None


class BaseTable(msgspec.Struct, forbid_unknown_fields=True):
    """[base]: harmonic motion of the base and the stops."""

    amplitude: Annotated[float, msgspec.Meta(ge=0, le=_LARGEST)] | None = None
    frequency: Positive | None = None
    phase: Finite = 0.0


class SensorTable(msgspec.Struct, forbid_unknown_fields=True):
    """[sensor]: gain, offset, filter and noise of the instrument."""

    gain: Finite | None = None
    offset: Finite | None = None
    delay: Finite = 0.0
    drift: Finite | None = None
    sigma: Positive | None = None
    quantisation: Positive | None = None
    clip: Positive | None = None
    cutoff: Annotated[float, msgspec.Meta(gt=0)] | None = None  # infinite: no low-pass
    order: Annotated[int, msgspec.Meta(ge=1, le=12)] = 2
    impulse_response: Annotated[list[Finite], msgspec.Meta(min_length=2)] | None = None
    interval: Positive | None = None


class FitTable(msgspec.Struct, forbid_unknown_fields=True):
    """[fit]: parameters to fit although they are usually known."""

    free: list[str] = msgspec.field(default_factory=list)


class ReadTable(msgspec.Struct, forbid_unknown_fields=True):
    """[read]: description of a file without the usual header."""

    skip_rows: Annotated[int, msgspec.Meta(ge=0)] = 0
    column: int | str | None = None
    quantity: str | None = None
    unit: str | None = None
    time_column: int | str | None = None
    time_unit: str | None = None
    sample_rate: Positive | None = None
    frame_rate: Positive | None = None
    part: str | None = None
    window: tuple[float, float] | None = None


class Sidecar(msgspec.Struct, forbid_unknown_fields=True):
    """All tables of a sidecar. [truth] is for readers of the file; the package ignores it."""

    system: SystemTable = msgspec.field(default_factory=SystemTable)
    upper: UpperTable = msgspec.field(default_factory=UpperTable)
    base: BaseTable = msgspec.field(default_factory=BaseTable)
    fixed: dict[str, Finite] = msgspec.field(default_factory=dict)
    start: dict[str, Finite] = msgspec.field(default_factory=dict)
    sensor: SensorTable = msgspec.field(default_factory=SensorTable)
    fit: FitTable = msgspec.field(default_factory=FitTable)
    read: ReadTable = msgspec.field(default_factory=ReadTable)
    truth: dict[str, object] = msgspec.field(default_factory=dict)


def read_sidecar(path: Path) -> Sidecar:
    """A sidecar file. Raises `FileError`."""
    text = read_text(path)
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also for very long numbers and nested lists
        where = re.search(r"at line (\d+)|at end of document", str(error))
        line = None if where is None else int(where[1] or len(text.splitlines()))
        problem = re.sub(r" \(at .*\)$", "", str(error)).split("; ")[0]
        raise FileError(path, line, f"not valid TOML ({problem})", "mend the syntax") from error
    try:
        sidecar = msgspec.convert(tables, Sidecar)
    except msgspec.ValidationError as error:
        raise _explain(path, text, tables, str(error)) from error
    _check_sensor(path, text, sidecar.sensor)
    _check_complete(path, text, sidecar)
    _check_read(path, text, sidecar.read)
    return sidecar


def _explain(path: Path, text: str, tables: dict[str, Any], message: str) -> FileError:
    """An error of msgspec, in terms of the sidecar."""
    found = re.fullmatch(r"(.*?)(?: - at `\$\.?([^`]*)`)?", message, re.DOTALL)
    assert found is not None
    problem, place = found[1], found[2] or ""
    unknown = re.search(r"unknown field `(.+)`", problem, re.DOTALL)
    if unknown:
        key, allowed = unknown[1], _keys(place)
        close = difflib.get_close_matches(key, allowed, 1)
        hint = f"did you mean `{close[0]}`" if close else f"use one of {', '.join(allowed)}"
        where = f"in [{place}]" if place else "at the top"
        return FileError(path, line_of(text, key), f"unknown key `{key}` {where}", hint)
    if place.endswith("[...]"):
        place = f"{place[:-5]}.{_wrong_entry(tables[place[:-5]])}"
    key = place.split(".")[-1].split("[")[0]
    problem = re.sub(r"[<>]= -?1\.79\S+", "that is finite", problem)
    for technical, word in _WORDS.items():
        problem = problem.replace(f"`{technical}`", word)
    return FileError(
        path, line_of(text, key), f"`{place}` cannot be used ({problem})", "correct its value"
    )


def _keys(table: str) -> list[str]:
    own = next((f.type for f in msgspec.structs.fields(Sidecar) if f.name == table), Sidecar)
    return [field.name for field in msgspec.structs.fields(own)]


def _wrong_entry(table: dict[str, Any]) -> str:
    """The first key whose value is not a finite number."""
    for name, value in table.items():
        try:
            msgspec.convert(value, Finite)
        except msgspec.ValidationError:
            return name
    raise AssertionError("msgspec found one")


def _check_sensor(path: Path, text: str, sensor: SensorTable) -> None:
    """Checks that a low-pass is given completely, and in one way only."""
    key, place = "impulse_response", line_of(text, "impulse_response")
    if (sensor.impulse_response is None) != (sensor.interval is None):
        place = line_of(text, "interval") if place is None else place
        raise FileError(path, place, f"`{key}` and `interval` need each other", "give both")
    if sensor.impulse_response is not None and sensor.cutoff is not None:
        raise FileError(path, place, f"`{key}` and `cutoff` are two low-passes", "give one of them")


def _check_complete(path: Path, text: str, sidecar: Sidecar) -> None:
    """Checks that a second stop has a position, and a moving base an amplitude and a frequency."""
    upper, base = sidecar.upper, sidecar.base
    if upper.law is not None and upper.gap is None:
        place = line_of(text, "upper")
        raise FileError(path, place, "the upper stop has no position", "add `gap` under [upper]")
    if base != BaseTable() and None in (base.amplitude, base.frequency):
        lacks = "amplitude" if base.amplitude is None else "frequency"
        place = line_of(text, "base")
        raise FileError(path, place, f"[base] has no `{lacks}`", f"add `{lacks}` under [base]")


def _check_read(path: Path, text: str, read: ReadTable) -> None:
    needed = {"quantity": "column", "unit": "quantity", "time_unit": "time_column"}
    for key, other in needed.items():
        if getattr(read, key) is not None and getattr(read, other) is None:
            problem = f"`{key}` says nothing without `{other}`"
            raise FileError(path, line_of(text, key), problem, f"add `{other}`")
    for key, kind, allowed in (
        ("quantity", "quantity", observables()),
        ("unit", f"unit of {read.quantity}", units_of(read.quantity or "")),
        ("time_unit", "unit of time", units_of(TIME)),
    ):
        value = getattr(read, key)
        if value is not None and value not in allowed:
            raise FileError(
                path,
                line_of(text, key),
                f"unknown {kind} `{value}`",
                f"use one of {', '.join(allowed)}",
            )
    if read.window is not None and not read.window[0] < read.window[1]:
        raise FileError(
            path, line_of(text, "window"), "the window ends before it begins", "swap its ends"
        )


def line_of(text: str, key: str) -> int | None:
    """The number of the line with a key or table."""
    pattern = re.compile(rf"^\s*\[?\s*[\"']?{re.escape(key)}[\"']?\s*[=\]]")
    for number, line in enumerate(text.splitlines(), start=1):
        if pattern.match(line):
            return number
    return None
