"""Tables from rows of cells: header, row of units, numbers, and text around them."""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

from impactjax._record.bounces import is_bounce
from impactjax._record.file_error import FileError
from impactjax._record.header import read_header, units_below
from impactjax._record.table import USUAL_HEADER, Table, number

Rows = list[tuple[int, list[str]]]
"""Rows of cells, each with the line on which it begins."""

SEARCHED = 200
"""Number of rows in which a header is looked for."""
_LETTERS = 2  # least number of letters in text after the rows


def begin_of_header(rows: Sequence[list[str]]) -> int | None:
    """The index of the first row that names a known quantity and is followed by numbers."""
    for i, row in enumerate(rows[:SEARCHED]):
        if has_number(row) or not names_something(row):
            continue
        below = rows[i + 1 : i + 3]
        if below and (has_number(below[0]) or (len(below) > 1 and has_number(below[1]))):
            return i
    return None


def names_something(cells: Sequence[str]) -> bool:
    """True if a cell names a known quantity, or a bounce."""
    return any(read_header(cell).quantity is not None or is_bounce(cell) for cell in cells)


def has_number(cells: Sequence[str]) -> bool:
    """True if a cell is a finite number, with a decimal point or comma."""
    return any(math.isfinite(number(cell, True)) for cell in cells)


def table_of_rows(path: Path, rows: Rows, separator: str, part: str = "") -> Table:
    """The table in rows, of which the first is the header if it has no number.

    A row of units below the header is joined with it. Text after the numbers is left out. Raises
    `FileError`.
    """
    if not rows:
        raise FileError(path, None, "it is empty", f"it needs {USUAL_HEADER} and rows of numbers")
    header_line, first = rows[0]
    decimal_comma = separator != ","
    has_header = not any(math.isfinite(number(cell, decimal_comma)) for cell in first)
    while has_header and len(first) > 1 and not first[-1]:
        first.pop()
    body = rows[1:] if has_header else rows
    header = [cell.strip() for cell in first] if has_header else None
    if header is not None and len(body) > 1:
        joined = None if has_number(body[0][1]) else units_below(header, body[0][1])
        if joined is not None:
            header, body = joined, body[1:]
    end = _end(body) if has_header else len(body)
    notes = ()
    if end < len(body):
        notes = (f"The text after the table, from line {body[end][0]} on, is not used.",)
        body = body[:end]
    _check_widths(path, len(first), body, separator)
    if not body:
        raise FileError(path, header_line, "no rows follow the header", "add the measured rows")
    padded = itertools.zip_longest(first, *(row for _, row in body))
    columns = [column[1:] for column in padded]
    lines = [line for line, _ in body]
    return Table(path, header, header_line, columns, lines, decimal_comma, part, notes)


def _end(body: Rows) -> int:
    """The number of rows before text that ends the table: no row of numbers may follow it, and it
    has no numbers itself unless a blank line is before it.
    """
    end = len(body)
    while end > 1 and _is_text(body[end - 1][1]):
        end -= 1
    apart = end < len(body) and body[end][0] > body[end - 1][0] + 1
    return end if apart or not any(has_number(cells) for _, cells in body[end:]) else len(body)


def _is_text(cells: Sequence[str]) -> bool:
    """True for a row that begins with words."""
    first = next((cell.strip() for cell in cells if cell.strip()), "")
    words = sum(c.isalpha() for c in first) >= _LETTERS and first.isprintable()
    return words and first.lower() not in ("nan", "na") and math.isnan(number(first, True))


def _check_widths(path: Path, width: int, body: Rows, separator: str) -> None:
    """Checks that no row has more cells than the first, apart from empty ones at its end."""
    for line, row in body:
        while len(row) > width and not row[-1]:
            row.pop()
        if len(row) > width:
            remedy = "give every row the same columns"
            if separator == ",":
                remedy = "put commas between columns only, and a point in decimal numbers"
            problem = f"there are {len(row)} cells, but {width} in the first row"
            raise FileError(path, line, problem, remedy)
