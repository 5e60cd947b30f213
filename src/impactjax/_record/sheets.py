"""Reader of spreadsheets, `.xlsx`."""

from datetime import datetime, time
from pathlib import Path

from impactjax._record.file_error import FileError
from impactjax._record.needed import DAMAGE, needed, unreadable_as
from impactjax._record.rows import Rows, begin_of_header, table_of_rows
from impactjax._record.table import Table

_POINT = ","  # as in a table with commas between the columns: numbers have a decimal point


def read_sheets(path: Path, skip_rows: int) -> list[Table | FileError]:
    """The table of each sheet, or an error if it holds none. Raises `FileError` for the file."""
    found: list[Table | FileError] = []
    for name, rows in _sheets(path).items():
        kept = [(i, cells) for i, cells in enumerate(rows, start=1) if any(cells) and i > skip_rows]
        place = Path(f"{path}/{name}")
        try:
            begin = begin_of_header([cells for _, cells in kept]) or 0
            found.append(table_of_rows(place, _cut(kept[begin:]), _POINT, name))
        except FileError as error:
            found.append(error)
    if not found:
        raise FileError(path, None, "it has no sheet with cells", "save what was measured in one")
    return found


def _sheets(path: Path) -> dict[str, list[list[str]]]:
    openpyxl = needed(path, "openpyxl", "openpyxl")
    try:
        with path.open("rb") as file:
            book = openpyxl.load_workbook(file, read_only=True, data_only=True)
            return {
                sheet.title: [[_text(cell) for cell in row] for row in sheet.values]
                for sheet in book.worksheets
            }
    except DAMAGE as error:
        raise unreadable_as(path, "a spreadsheet") from error


def _text(cell: object) -> str:
    """The content of a cell as a text."""
    if cell is None:
        return ""
    if isinstance(cell, datetime | time):
        return cell.isoformat()
    return cell if isinstance(cell, str) else repr(cell)


def _cut(rows: Rows) -> Rows:
    """Rows without empty cells at their end."""
    for _, cells in rows:
        while cells and not cells[-1].strip():
            cells.pop()
    return rows
