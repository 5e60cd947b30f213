"""From a file to a recording."""

import csv
import math
import re
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from impactjax._measure.file_error import FileError
from impactjax._measure.quantity import (
    IMPACT_TIME,
    QUANTITIES,
    TIME_UNITS,
    AbstractQuantity,
)
from impactjax._measure.recording import AnyRecording, ImpactTimes, Recording
from impactjax._measure.sidecar import ReadTable, Sidecar, read_sidecar

_HEADER = "a header such as `time [s], angle [deg]` or `impact time [s]`"
_BY_NAME: dict[str, AbstractQuantity] = {quantity.name: quantity for quantity in QUANTITIES}


class File(NamedTuple):
    """A recording and what its sidecar says."""

    path: Path
    recording: AnyRecording
    sidecar: Sidecar
    sidecar_path: Path | None


class _Column(NamedTuple):
    """A column of the file: where it is, what it holds, and the factor to SI units."""

    position: int
    quantity: str
    factor: float


class _Rows(NamedTuple):
    """The cells of a file, with the line each row came from."""

    header: list[str] | None
    header_line: int
    cells: list[list[str]]
    lines: list[int]


def read_recording(path: Path, sidecar_path: Path | None = None) -> File:
    """A recording from a CSV file, with the help of the sidecar beside it if there is one.

    The file has a header that names quantity and unit, `time [s], angle [deg]`, or the list of
    impact times, `impact time [s]`; or the sidecar says how to read it.

    Raises `FileError`, whose message is one sentence with file, line and remedy.
    """
    beside = path.with_suffix(".toml")
    if sidecar_path is None and beside != path and beside.is_file():
        sidecar_path = beside
    sidecar = Sidecar() if sidecar_path is None else read_sidecar(sidecar_path)
    rows = _rows(path, sidecar.read)
    time, observed = _columns(path, rows, sidecar.read)
    values = _numbers(path, rows, observed)
    if observed.quantity == IMPACT_TIME:
        lines = np.asarray(rows.lines)
        _check_increasing(path, values, lines)
        inside = _inside(path, sidecar.read, values)
        return File(path, ImpactTimes(jnp.asarray(values[inside])), sidecar, sidecar_path)
    if time is None:
        assert sidecar.read.sample_rate is not None
        ts = np.arange(len(values)) / sidecar.read.sample_rate
    else:
        ts = _numbers(path, rows, time)
        _check_increasing(path, ts, np.asarray(rows.lines))
    inside = _inside(path, sidecar.read, ts)
    recording = Recording(
        jnp.asarray(ts[inside]), jnp.asarray(values[inside]), _BY_NAME[observed.quantity]
    )
    return File(path, recording, sidecar, sidecar_path)


def _rows(path: Path, read: ReadTable) -> _Rows:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        raise FileError(
            path, line, "it is not UTF-8 text", "save it with UTF-8 encoding"
        ) from error
    except OSError as error:
        remedy = "check the name" if isinstance(error, FileNotFoundError) else "check the file"
        raise FileError(path, None, f"cannot be read ({error.strerror})", remedy) from error
    reader = csv.reader(text.splitlines(), skipinitialspace=True)
    numbered = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    kept = [(line, row) for line, row in numbered[read.skip_rows :] if any(row)]
    if not kept:
        raise FileError(path, None, "it is empty", f"it needs {_HEADER} and rows of numbers")
    header_line, first = kept[0]
    header = None if all(_is_number(cell) for cell in first) else first
    body = kept if header is None else kept[1:]
    if not body:
        raise FileError(path, header_line, "no rows follow the header", "add the measured rows")
    lines, cells = [line for line, _ in body], [row for _, row in body]
    return _Rows(header, header_line, cells, lines)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _columns(path: Path, rows: _Rows, read: ReadTable) -> tuple[_Column | None, _Column]:
    """The column of time, if the file has one, and that of the observed quantity."""
    if read.column is not None:
        observed = _named_column(path, rows, read)
        if observed.quantity == IMPACT_TIME:
            return None, observed
        return _time_column(path, rows, read), observed
    if rows.header is None:
        raise FileError(
            path,
            rows.header_line,
            "there is no header",
            f"add {_HEADER}, or describe the file under [read] in a sidecar",
        )
    found = [_parse(path, rows, index, cell) for index, cell in enumerate(rows.header)]
    times = [column for column in found if column.quantity == "time"]
    others = [column for column in found if column.quantity != "time"]
    if len(others) != 1:
        raise FileError(
            path,
            rows.header_line,
            f"the header names {len(others)} quantities besides time",
            "choose one by `column` under [read] in a sidecar, or keep one column",
        )
    if others[0].quantity == IMPACT_TIME:
        return None, others[0]
    if len(times) == 1:
        return times[0], others[0]
    return _time_column(path, rows, read), others[0]


def _parse(path: Path, rows: _Rows, index: int, cell: str) -> _Column:
    """A column from its header, `quantity [unit]`."""
    match = re.fullmatch(r"(.+?)\s*\[(.+)\]", cell)
    if match is None:
        raise FileError(path, rows.header_line, f"column `{cell}` has no unit", f"write {_HEADER}")
    name, unit = match[1].strip().lower(), match[2].strip()
    known = {"time": TIME_UNITS, IMPACT_TIME: TIME_UNITS}
    known |= {quantity.name: quantity.units for quantity in QUANTITIES}
    if name not in known:
        raise FileError(
            path,
            rows.header_line,
            f"unknown quantity `{name}`",
            f"use one of {', '.join(known)}",
        )
    if unit not in known[name]:
        raise FileError(
            path,
            rows.header_line,
            f"unknown unit `{unit}` of {name}",
            f"use one of {', '.join(known[name])}",
        )
    return _Column(index, name, known[name][unit])


def _named_column(path: Path, rows: _Rows, read: ReadTable) -> _Column:
    assert read.column is not None
    index = _index(path, rows, read.column)
    if read.quantity is None or read.unit is None:
        if rows.header is None:
            raise FileError(
                path,
                rows.header_line,
                "there is no header",
                "add `quantity` and `unit` under [read] in the sidecar",
            )
        return _parse(path, rows, index, rows.header[index])
    units = TIME_UNITS if read.quantity == IMPACT_TIME else _BY_NAME[read.quantity].units
    if read.unit not in units:
        raise FileError(
            path,
            None,
            f"the sidecar gives the unknown unit `{read.unit}` of {read.quantity}",
            f"use one of {', '.join(units)}",
        )
    return _Column(index, read.quantity, units[read.unit])


def _time_column(path: Path, rows: _Rows, read: ReadTable) -> _Column | None:
    if read.time_column is not None:
        factor = TIME_UNITS[read.time_unit or "s"]
        return _Column(_index(path, rows, read.time_column), "time", factor)
    if read.sample_rate is not None:
        return None
    raise FileError(
        path,
        rows.header_line,
        "there is no column of time",
        "add one, or `sample_rate` under [read] in a sidecar",
    )


def _index(path: Path, rows: _Rows, column: int | str) -> int:
    """Position of a column given by its name or, counted from 1, its number."""
    width = len(rows.cells[0])
    if isinstance(column, int):
        if not 1 <= column <= width:
            raise FileError(
                path,
                rows.lines[0],
                f"there is no column {column}",
                f"the sidecar can choose from 1 to {width}",
            )
        return column - 1
    if rows.header is None or column not in rows.header:
        names = ", ".join(rows.header) if rows.header else "none, there is no header"
        raise FileError(
            path, rows.header_line, f"there is no column `{column}`", f"the columns are: {names}"
        )
    return rows.header.index(column)


def _numbers(path: Path, rows: _Rows, column: _Column) -> np.ndarray:
    values = np.empty(len(rows.cells))
    for i, (line, row) in enumerate(zip(rows.lines, rows.cells, strict=True)):
        if column.position >= len(row):
            raise FileError(
                path, line, f"there is no column {column.position + 1}", "complete the row"
            )
        cell = row[column.position]
        if not _is_number(cell):
            shown = cell if len(cell) <= 40 else cell[:40] + "…"
            raise FileError(path, line, f"`{shown}` is not a number", "correct or delete the row")
        values[i] = float(cell)
        if not math.isfinite(values[i]):
            raise FileError(path, line, f"`{cell}` is not finite", "correct or delete the row")
    return values * column.factor


def _check_increasing(path: Path, ts: np.ndarray, lines: np.ndarray) -> None:
    wrong = np.flatnonzero(np.diff(ts) <= 0)
    if wrong.size:
        i = int(wrong[0]) + 1
        raise FileError(
            path,
            int(lines[i]),
            f"time does not increase ({ts[i]:g} s after {ts[i - 1]:g} s)",
            "sort the rows by time and delete repeated ones",
        )


def _inside(path: Path, read: ReadTable, ts: np.ndarray) -> np.ndarray:
    if read.window is None:
        return np.ones(len(ts), bool)
    low, high = read.window
    inside = (ts >= low) & (ts <= high)
    if not inside.any():
        raise FileError(
            path,
            None,
            f"no row lies in the window from {low:g} to {high:g} s",
            f"the recording goes from {ts[0]:g} to {ts[-1]:g} s",
        )
    return inside
