"""The sidecar NAME.toml beside a recording: what the file itself does not say."""

import difflib
import re
import tomllib
from pathlib import Path
from typing import Annotated

import msgspec

from impactjax._measure.file_error import FileError
from impactjax._measure.quantity import IMPACT_TIME, QUANTITIES, TIME_UNITS

QUANTITY_NAMES = (*(quantity.name for quantity in QUANTITIES), IMPACT_TIME)

Positive = Annotated[float, msgspec.Meta(gt=0)]


class SystemTable(msgspec.Struct, forbid_unknown_fields=True):
    """[system]: what moves, and what it hits."""

    oscillator: str | None = None
    laws: list[str] | None = None
    dry_friction: bool | None = None


class SensorTable(msgspec.Struct, forbid_unknown_fields=True):
    """[sensor]: what stands between the motion and its samples."""

    gain: float = 1.0
    offset: float = 0.0
    delay: float = 0.0
    cutoff: Positive | None = None
    order: Annotated[int, msgspec.Meta(ge=1, le=12)] = 2


class ReadTable(msgspec.Struct, forbid_unknown_fields=True):
    """[read]: how to read a file without the usual header."""

    skip_rows: Annotated[int, msgspec.Meta(ge=0)] = 0
    column: int | str | None = None
    quantity: str | None = None
    unit: str | None = None
    time_column: int | str | None = None
    time_unit: str | None = None
    sample_rate: Positive | None = None
    window: tuple[float, float] | None = None


class Sidecar(msgspec.Struct, forbid_unknown_fields=True):
    """All tables of a sidecar. [truth] is for people: nothing here reads it."""

    system: SystemTable = msgspec.field(default_factory=SystemTable)
    fixed: dict[str, float] = msgspec.field(default_factory=dict)
    start: dict[str, float] = msgspec.field(default_factory=dict)
    sensor: SensorTable = msgspec.field(default_factory=SensorTable)
    read: ReadTable = msgspec.field(default_factory=ReadTable)
    truth: dict[str, object] = msgspec.field(default_factory=dict)


def read_sidecar(path: Path) -> Sidecar:
    """A sidecar file. Raises `FileError`."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise FileError(
            path, None, "it is not UTF-8 text", "save it with UTF-8 encoding"
        ) from error
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        where = re.search(r"line (\d+)", str(error))
        line = int(where[1]) if where else None
        problem = re.sub(r" \(at .*\)$", "", str(error))
        raise FileError(path, line, f"not valid TOML ({problem})", "mend the syntax") from error
    try:
        sidecar = msgspec.convert(tables, Sidecar)
    except msgspec.ValidationError as error:
        raise _explain(path, text, str(error)) from error
    _check_read(path, text, sidecar.read)
    return sidecar


def _explain(path: Path, text: str, message: str) -> FileError:
    unknown = re.search(r"unknown field `(.+?)`(?: - at `\$\.?(.*)`)?", message)
    if unknown:
        key, table = unknown[1], unknown[2] or ""
        allowed = _keys(table)
        close = difflib.get_close_matches(key, allowed, 1)
        hint = f"did you mean `{close[0]}`" if close else f"use one of {', '.join(allowed)}"
        where = f"in [{table}]" if table else "at the top"
        return FileError(path, line_of(text, key), f"unknown key `{key}` {where}", hint)
    place = re.search(r"^(.*) - at `\$\.?(.*)`$", message)
    problem, key = (place[1], place[2]) if place else (message, "")
    last = re.split(r"[.\[]", key)[-1].rstrip("]")
    return FileError(
        path, line_of(text, last), f"`{key}` cannot be used ({problem})", "correct its value"
    )


def _keys(table: str) -> list[str]:
    owner = {"": Sidecar, "system": SystemTable, "sensor": SensorTable, "read": ReadTable}[table]
    return [field.name for field in msgspec.structs.fields(owner)]


def _check_read(path: Path, text: str, read: ReadTable) -> None:
    if read.quantity is not None and read.quantity not in QUANTITY_NAMES:
        raise FileError(
            path,
            line_of(text, "quantity"),
            f"unknown quantity `{read.quantity}`",
            f"use one of {', '.join(QUANTITY_NAMES)}",
        )
    if read.time_unit is not None and read.time_unit not in TIME_UNITS:
        raise FileError(
            path,
            line_of(text, "time_unit"),
            f"unknown unit of time `{read.time_unit}`",
            f"use one of {', '.join(TIME_UNITS)}",
        )
    if read.window is not None and not read.window[0] < read.window[1]:
        raise FileError(
            path, line_of(text, "window"), "the window ends before it begins", "swap its ends"
        )


def line_of(text: str, key: str) -> int | None:
    """The line on which a key or table stands."""
    pattern = re.compile(rf"^\s*\[?\s*[\"']?{re.escape(key)}[\"']?\s*[=\]]")
    for number, line in enumerate(text.splitlines(), start=1):
        if pattern.match(line):
            return number
    return None
