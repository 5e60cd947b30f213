"""Reader of text tables with commas, semicolons, tabs or blanks between the columns."""

import csv
import math
import re
from itertools import pairwise
from pathlib import Path

from impactjax._record.file_error import FileError
from impactjax._record.rows import SEARCHED, Rows, begin_of_header, names_something, table_of_rows
from impactjax._record.table import Table, number
from impactjax._record.text import read_any_text

_BLANK = " "  # any number of blanks between columns
_COMMENT = re.compile(r"\s*(?:#|%|//|!)+")
_BLANKS_APART = re.compile(
    r"[^\s\[\](),]+(?:\s+[^\s\[\]()]+)*\s*[\[(][^\])]*[\])]|\S+"  # a unit may follow a blank
)


def read_text_table(path: Path, skip_rows: int) -> Table:
    """The table in a text file, without blank lines, comments, and text above and below it. Raises
    `FileError`.
    """
    text, notes = read_any_text(path)
    table = table_of_lines(path, text.splitlines(), skip_rows)
    return table._replace(notes=(*notes, *table.notes))


def table_of_lines(path: Path, lines: list[str], skip_rows: int = 0, part: str = "") -> Table:
    """The table in the lines of a text."""
    lines = ["" if i < skip_rows else line for i, line in enumerate(lines)]
    begin = _begin(lines)
    lines = [
        line if i == begin else "" if i < begin or _COMMENT.match(line) else line
        for i, line in enumerate(lines)
    ]
    if begin < len(lines):
        lines[begin] = _uncommented(lines[begin])
    separator = _separator(lines[begin:])
    split = _blank_rows if separator == _BLANK else _rows
    return table_of_rows(path, split(path, lines, separator), separator, part)


def _begin(lines: list[str]) -> int:
    """The index of the header, or of the first line that is neither blank nor a comment."""
    filled = [i for i, line in enumerate(lines) if line.strip()]
    looked_at = filled[: 2 * SEARCHED]
    shown = [i for i in looked_at if not _COMMENT.match(lines[i])]
    first = shown[0] if shown else len(lines)
    for i in looked_at:
        below = [lines[j] for j in shown if j > i][:2]
        line = _uncommented(lines[i])
        separator = _separator([line, *below])
        cells = [_cells(each, separator) for each in (line, *below)]
        if begin_of_header(cells) == 0:
            return i
        if i >= first and _is_header_only(lines, i, filled):
            return i
    return first


def _is_header_only(lines: list[str], i: int, filled: list[int]) -> bool:
    """True for a last line that is a header."""
    return i == filled[-1] and names_something(_cells(lines[i], _separator([lines[i]])))


def _uncommented(line: str) -> str:
    return _COMMENT.sub("", line, count=1) if _COMMENT.match(line) else line


def _cells(line: str, separator: str) -> list[str]:
    if separator == _BLANK:
        return _BLANKS_APART.findall(line)
    return [cell.strip().strip('"') for cell in line.split(separator)]


def _separator(lines: list[str]) -> str:
    """The separator of the columns, judged by the first two rows."""
    first, second = [*(line for line in lines if line.strip()), "", ""][:2]
    for separator in ("\t", ";", ","):
        if separator in first:
            return separator
    words = second.split()
    spaced = len(words) > 1 and all(math.isfinite(number(word, True)) for word in words)
    return _BLANK if spaced else ","


def _rows(path: Path, lines: list[str], separator: str) -> Rows:
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)
    kept: Rows = []
    line = 1
    try:
        for row in reader:
            cells = [cell if cell.strip() else "" for cell in row]
            if any(cells):
                kept.append((line, cells))
            line = reader.line_num + 1
    except csv.Error as error:
        raise FileError(path, line, f"it is not CSV ({error})", "check its quotes") from error
    return kept


def _blank_rows(path: Path, lines: list[str], separator: str) -> Rows:
    """Rows with blanks between the columns. In a header a blank may precede a unit in brackets.

    The cells of a row with gaps belong to the columns below which they stand. Raises `FileError`.
    """
    del separator
    found = [(i, [*_BLANKS_APART.finditer(line)]) for i, line in enumerate(lines, start=1)]
    found = [(i, cells) for i, cells in found if cells]
    width = max((len(cells) for _, cells in found[:2]), default=0)
    spans = None
    rows: Rows = []
    for i, cells in found:
        texts = [cell[0] for cell in cells]
        if 1 < len(cells) < width and rows and math.isfinite(number(texts[0], True)):
            if spans is None:
                spans = _spans([each for _, each in found[1:] if len(each) == width])
            texts = _placed(path, i, cells, spans)
        rows.append((i, texts))
    return rows


def _spans(rows: list[list[re.Match[str]]]) -> list[tuple[int, int]]:
    """Begin and end of the columns, as far as all complete rows reach."""
    ends = [[(cell.start(), cell.end()) for cell in row] for row in rows]
    columns = zip(*ends, strict=True)
    return [(min(a for a, _ in column), max(b for _, b in column)) for column in columns]


def _placed(
    path: Path, line: int, cells: list[re.Match[str]], spans: list[tuple[int, int]]
) -> list[str]:
    """The cells of a row with gaps in the columns below which they stand."""
    apart = all(left[1] <= right[0] for left, right in pairwise(spans))
    placed = [""] * len(spans)
    for cell in cells:
        over = [k for k, (a, b) in enumerate(spans) if cell.start() < b and cell.end() > a]
        if not apart or len(over) != 1 or placed[over[0]]:
            problem = f"there are {len(cells)} cells, and it is unclear in which columns"
            raise FileError(path, line, problem, "put commas or tabs between the columns")
        placed[over[0]] = cell[0]
    return placed
