"""Tables: files of any format as columns of text cells or numbers."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from impactjax._record.file_error import FileError

USUAL_HEADER = "a header such as `time [s], angle [deg]` or `impact time [s]`"
_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d*,\d+(?:[eE][-+]?\d+)?\s*")


class Table(NamedTuple):
    """The columns of a file: text cells as in the file, or numbers.

    Text columns have a line number for each row, and `None` where a row is too short.

    - `part`: name of the sheet or of the file in an archive that it is from; empty if it is whole.
    - `notes`: sentences on what was left out when it was read.
    """

    path: Path
    header: list[str] | None
    header_line: int | None
    columns: Sequence[Sequence[str | None] | np.ndarray]
    lines: Sequence[int] | None = None
    decimal_comma: bool = False
    part: str = ""
    notes: tuple[str, ...] = ()

    def wrong_header(self, problem: str, remedy: str) -> FileError:
        """An error about the columns."""
        return FileError(self.path, self.header_line, problem, remedy)

    def line(self, row: int) -> int | None:
        """The line number of a row, if the file has lines."""
        return None if self.lines is None else self.lines[row]

    def without_empty(self, positions: Sequence[int]) -> "Table":
        """The table without the rows in which all these columns are empty, as those of a run that
        is shorter than the one beside it.
        """
        filled = np.any([_filled(self.columns[position]) for position in positions], axis=0)
        if filled.all():
            return self
        rows = np.flatnonzero(filled).tolist()
        columns = [
            column[rows] if isinstance(column, np.ndarray) else [column[row] for row in rows]
            for column in self.columns
        ]
        lines = None if self.lines is None else [self.lines[row] for row in rows]
        return self._replace(columns=columns, lines=lines)

    def count(self, position: int) -> int:
        """The number of cells of a column that are not empty."""
        return int(np.count_nonzero(_filled(self.columns[position])))

    def varies(self, position: int) -> bool:
        """True if the filled cells of a column differ."""
        column = self.columns[position]
        if isinstance(column, np.ndarray):
            return bool(np.nanmin(column) < np.nanmax(column)) if self.count(position) else False
        return len({cell.strip() for cell in column if cell is not None and cell.strip()}) > 1


def numbers(table: Table, position: int) -> np.ndarray:
    """A column as finite numbers. Raises `FileError`."""
    values = numbers_and_gaps(table, position)
    missing = np.flatnonzero(np.isnan(values))
    if missing.size:
        raise _unusable(table, position, int(missing[0]))
    return values


def numbers_and_gaps(table: Table, position: int) -> np.ndarray:
    """A column as numbers, NaN for cells that are empty or marked missing. Raises `FileError`."""
    column = table.columns[position]
    if isinstance(column, np.ndarray):
        values = column.astype(float)
        wrong = np.flatnonzero(np.isinf(values))
    else:
        values = np.array([number(cell, table.decimal_comma) for cell in column])
        numberless = np.flatnonzero(~np.isfinite(values))
        wrong = np.array([i for i in numberless.tolist() if not _is_gap(column[i])], int)
    if wrong.size:
        raise _unusable(table, position, int(wrong[0]))
    return values


def _filled(column: Sequence[str | None] | np.ndarray) -> np.ndarray:
    if isinstance(column, np.ndarray):
        return ~np.isnan(column.astype(float))
    return np.array([cell is not None and bool(cell.strip()) for cell in column], bool)


def number(cell: str | None, decimal_comma: bool = False) -> float:
    """The number in a cell; NaN if it is not a number."""
    if cell is None or "_" in cell:
        return math.nan
    if decimal_comma and _DECIMAL_COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _is_gap(cell: str | None) -> bool:
    """True if a cell is empty or marked as missing, such as "n/a"."""
    return cell is not None and cell.strip().lower() in ("", "nan", "na", "n/a", "-")


def _unusable(table: Table, position: int, row: int) -> FileError:
    column, line = table.columns[position], table.line(row)
    remedy = "correct or delete the row"
    if isinstance(column, np.ndarray):
        name = table.header[position] if table.header else str(position + 1)
        problem = f"`{name}` is {column[row]:g} in row {row + 1}"
        return FileError(table.path, line, problem, remedy)
    cell = column[row]
    if cell is None:
        problem, remedy = f"there is no column {position + 1}", "complete or delete the row"
    elif not cell.strip():
        problem = f"column {position + 1} is empty"
    elif math.isnan(number(cell)) and cell.lower().lstrip("+-") != "nan":
        problem = f"`{cell.strip()}` is not a number"
    else:
        problem = f"`{cell.strip()}` is not finite"
    return FileError(table.path, line, problem, remedy)
