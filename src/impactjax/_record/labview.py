"""Reader of LabVIEW's measurement files, `.lvm`."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.rows import Rows, table_of_rows
from impactjax._record.table import Table, number
from impactjax._record.text import read_any_text

FIRST_LINE = "LabVIEW Measurement"
_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ","}
_COMMENT = "Comment"


class _Segment(NamedTuple):
    """The first segment of a file: entries of its header by their keys, its rows, and the number of
    the line after them if there is another.
    """

    entries: dict[str, list[str]]
    rows: Rows
    next_line: int | None


def read_labview(path: Path) -> Table:
    """The first segment of a file, with the units of its header. Raises `FileError`.

    Its clock is in the column `X_Value` left of each channel, or only at the very left, or follows
    from `X0` and `Delta_X`.
    """
    text, notes = read_any_text(path)
    lines = text.splitlines()
    separator = _separator(path, lines)
    segment = _segment(path, lines, separator)
    header_line, names = segment.rows[0]
    width = len(names)
    while names and names[-1].strip() in ("", _COMMENT):
        names.pop()
    dimension = segment.entries.get("X_Dimension", [""])
    if any(each.strip().lower() not in ("", "time") for each in dimension[1:]):
        problem = f"its abscissa is `{dimension[1].strip()}`, and not time"
        raise FileError(path, header_line, problem, "export a record in time")
    units = segment.entries.get("Y_Unit_Label", [])
    units = [*units, *[""] * (len(names) - len(units))]
    headers = [_header(name, unit) for name, unit in zip(names, units, strict=False)]
    body = [(line, [*cells[: len(names)], *cells[width:]]) for line, cells in segment.rows[1:]]
    rows = [(header_line, headers), *body]
    table = table_of_rows(path, rows, separator)
    if segment.next_line is not None:
        said = f"The file has several segments; the first is used, up to line {segment.next_line}."
        notes = (*notes, said)
    return _with_clock(table, segment.entries)._replace(notes=(*notes, *table.notes))


def _separator(path: Path, lines: list[str]) -> str:
    for i, line in enumerate(lines, start=1):
        key, _, value = line.replace(",", "\t").partition("\t")
        if key.strip() == "Separator":
            word = value.strip().lower()
            if word not in _SEPARATORS:
                problem = f"unknown separator `{value.strip()}`"
                raise FileError(path, i, problem, "export with tabs or commas")
            return _SEPARATORS[word]
        if line.startswith(_END):
            break
    return "\t"


def _segment(path: Path, lines: list[str], separator: str) -> _Segment:
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    remedy = "check that it is complete, or save it anew"
    if len(ends) < 2:
        problem = f"its header does not end twice with `{_END}`"
        raise FileError(path, None, problem, remedy)
    entries = {}
    for line in lines[ends[0] + 1 : ends[1]]:
        cells = line.split(separator)
        entries[cells[0].strip()] = cells
    rows: Rows = []
    next_line = None
    for i, line in enumerate(lines[ends[1] + 1 :], start=ends[1] + 2):
        cells = line.split(separator)
        if cells[0].strip() in ("Channels", "X_Value") and rows:
            next_line = i
            break
        if line.strip():
            rows.append((i, cells))
    if not rows or rows[0][1][0].strip() != "X_Value":
        raise FileError(path, ends[1] + 2, "no column `X_Value` follows its header", remedy)
    if len(rows) == 1:
        raise FileError(path, rows[0][0], "no rows follow the header", "add the measured rows")
    return _Segment(entries, rows, next_line)


def _header(name: str, unit: str) -> str:
    name, unit = name.strip(), unit.strip()
    if name == "X_Value":
        return "time [s]"
    return f"{name} [{unit}]" if unit and not name.endswith(("]", ")")) else name


def _with_clock(table: Table, entries: dict[str, list[str]]) -> Table:
    """The table with times from the header where the file leaves out the column of time."""
    if table.count(0):
        return table
    cells = [entries.get(key, []) for key in ("X0", "Delta_X")]
    first, step = (number(each[1].strip(), True) if len(each) > 1 else np.nan for each in cells)
    if not (np.isfinite(first) and step > 0):
        problem = "its column of time is empty, and `X0` and `Delta_X` do not give it"
        raise table.wrong_header(problem, "export it with a column of time")
    steps = {each.strip() for each in cells[1][1:] if each.strip()}
    if len(steps) > 1:
        problem = "its channels differ in `Delta_X`, but it has no column of time"
        raise table.wrong_header(problem, "export it with a column of time for each channel")
    times = first + step * np.arange(len(table.columns[0]))
    return table._replace(columns=[times, *table.columns[1:]])
