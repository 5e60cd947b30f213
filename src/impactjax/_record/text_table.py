"""Reader of text tables with commas, semicolons, tabs or blanks between the columns."""

import csv
import itertools
import math
import re
from pathlib import Path

from impactjax._record.file_error import FileError
from impactjax._record.table import USUAL_HEADER, Table, number
from impactjax._record.text import read_text

_BLANK = " "  # any number of blanks between columns

_Rows = list[tuple[int, list[str]]]  # each with the line on which it begins


def read_text_table(path: Path, skip_rows: int) -> Table:
    """The table in a text file, without blank lines. Raises `FileError`."""
    lines = read_text(path).splitlines()[skip_rows:]
    separator = _separator(lines)
    split = _blank_rows if separator == _BLANK else _rows
    kept = split(path, lines, separator, skip_rows)
    if not kept:
        raise FileError(path, None, "it is empty", f"it needs {USUAL_HEADER} and rows of numbers")
    decimal_comma = separator != ","
    header_line, first = kept[0]
    has_header = not any(math.isfinite(number(cell, decimal_comma)) for cell in first)
    while has_header and not first[-1]:
        first.pop()
    _check_widths(path, kept, separator)
    header = [cell.strip() for cell in first] if has_header else None
    body = kept[1:] if has_header else kept
    if not body:
        raise FileError(path, header_line, "no rows follow the header", "add the measured rows")
    padded = itertools.zip_longest(first, *(row for _, row in body))
    columns = [column[1:] for column in padded]
    return Table(path, header, header_line, columns, [line for line, _ in body], decimal_comma)


def _separator(lines: list[str]) -> str:
    """The separator of the columns, judged by the first two rows."""
    first, second = [*(line for line in lines if line.strip()), "", ""][:2]
    for separator in ("\t", ";", ","):
        if separator in first:
            return separator
    words = second.split()
    spaced = len(words) > 1 and all(math.isfinite(number(word, True)) for word in words)
    return _BLANK if spaced else ","


def _rows(path: Path, lines: list[str], separator: str, skip_rows: int) -> _Rows:
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)
    kept: _Rows = []
    line = skip_rows + 1
    try:
        for row in reader:
            cells = [cell if cell.strip() else "" for cell in row]
            if any(cells):
                kept.append((line, cells))
            line = skip_rows + reader.line_num + 1
    except csv.Error as error:
        raise FileError(path, line, f"it is not CSV ({error})", "check its quotes") from error
    return kept


def _blank_rows(path: Path, lines: list[str], separator: str, skip_rows: int) -> _Rows:
    """Rows with blanks between the columns. In a header a blank may precede a unit in brackets."""
    del path, separator
    cells = [
        re.findall(r"[^\s\[\](),]+(?:\s+[^\s\[\]()]+)*\s*[\[(][^\])]*[\])]|\S+", line)
        for line in lines
    ]
    return [(skip_rows + i, row) for i, row in enumerate(cells, start=1) if row]


def _check_widths(path: Path, kept: _Rows, separator: str) -> None:
    """Checks that no row has more cells than the first, apart from empty ones at its end."""
    width = len(kept[0][1])
    for line, row in kept:
        while len(row) > width and not row[-1]:
            row.pop()
        if len(row) > width:
            remedy = "give every row the same columns"
            if separator == ",":
                remedy = "put commas between columns only, and a point in decimal numbers"
            problem = f"there are {len(row)} cells, but {width} in the first row"
            raise FileError(path, line, problem, remedy)
