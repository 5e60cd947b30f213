"""From a CSV file to rows of cells, and from a column of cells to numbers."""

import csv
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from impactjax._measure.file_error import FileError
from impactjax._measure.text import read_text

USUAL_HEADER = "a header such as `time [s], angle [deg]` or `impact time [s]`"


class Table(NamedTuple):
    """The cells of a file, with the line each row came from."""

    path: Path
    header: list[str] | None
    header_line: int
    cells: list[list[str]]
    lines: list[int]

    def wrong_header(self, problem: str, remedy: str) -> FileError:
        """The error that something is wrong with the columns."""
        return FileError(self.path, self.header_line, problem, remedy)


def read_table(path: Path, skip_rows: int) -> Table:
    """The rows of a CSV file; blank ones are left out. Raises `FileError`."""
    kept = _rows(path, read_text(path).splitlines(), skip_rows)
    if not kept:
        raise FileError(path, None, "it is empty", f"it needs {USUAL_HEADER} and rows of numbers")
    _check_commas(path, kept)
    header_line, first = kept[0]
    has_header = not any(math.isfinite(_number(cell)) for cell in first)
    header = [cell.strip() for cell in first] if has_header else None
    body = kept[1:] if has_header else kept
    if not body:
        raise FileError(path, header_line, "no rows follow the header", "add the measured rows")
    lines, cells = [line for line, _ in body], [row for _, row in body]
    return Table(path, header, header_line, cells, lines)


def numbers(table: Table, position: int) -> np.ndarray:
    """A column as finite numbers. Raises `FileError`."""
    values = np.array(
        [_number(row[position]) if position < len(row) else math.nan for row in table.cells]
    )
    wrong = np.flatnonzero(~np.isfinite(values))
    if not wrong.size:
        return values
    row, line = table.cells[wrong[0]], table.lines[wrong[0]]
    if position >= len(row):
        raise FileError(
            table.path, line, f"there is no column {position + 1}", "complete or delete the row"
        )
    cell = row[position].strip()
    remedy = "correct or delete the row"
    if not cell:
        raise FileError(table.path, line, f"column {position + 1} is empty", remedy)
    kind = "not a number" if _is_word(cell) else "not finite"
    raise FileError(table.path, line, f"`{cell}` is {kind}", remedy)


def _rows(path: Path, lines: list[str], skip_rows: int) -> list[tuple[int, list[str]]]:
    """Rows that are not blank, each with the line on which it begins."""
    reader = csv.reader(lines[skip_rows:], skipinitialspace=True, strict=True)
    kept: list[tuple[int, list[str]]] = []
    line = skip_rows + 1
    try:
        for row in reader:
            while row and not row[-1].strip():
                row.pop()
            if row:
                kept.append((line, row))
            line = skip_rows + reader.line_num + 1
    except csv.Error as error:
        raise FileError(path, line, f"it is not CSV ({error})", "check its quotes") from error
    return kept


def _check_commas(path: Path, kept: list[tuple[int, list[str]]]) -> None:
    """That commas separate the columns, and nothing else."""
    line, first = kept[0]
    wider = next((each for each in kept if len(each[1]) > len(first)), None)
    if any(sign in cell for sign in ";\t" for cell in first):
        problem = "its columns are not separated by commas"
    elif wider is not None:
        line, row = wider
        problem = f"there are {len(row)} cells, but {len(first)} in the first row"
    else:
        return
    remedy = "put commas between columns only, and a point in decimal numbers"
    raise FileError(path, line, problem, remedy)


def _number(cell: str) -> float:
    """The number in a cell; NaN if there is none."""
    try:
        return math.nan if "_" in cell else float(cell)
    except ValueError:
        return math.nan


def _is_word(cell: str) -> bool:
    """Whether a cell is none of NaN, infinity, and what overflows."""
    return math.isnan(_number(cell)) and cell.lower().lstrip("+-") != "nan"
