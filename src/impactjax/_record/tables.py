"""The table of a file of any format."""

from collections.abc import Callable
from pathlib import Path

from impactjax._record.archive import is_archive, is_book, read_archive
from impactjax._record.array_table import ARRAY_SUFFIXES, read_array_table
from impactjax._record.bounces import bounces
from impactjax._record.columns import samples_of
from impactjax._record.file_error import FileError
from impactjax._record.labview import FIRST_LINE, read_labview
from impactjax._record.sheets import read_sheets
from impactjax._record.sidecar import ReadTable
from impactjax._record.table import Table
from impactjax._record.text_table import read_text_table
from impactjax._record.uff import read_uff
from impactjax._record.waveforms import read_tdms

_WAVEFORMS: dict[str, Callable[[Path], Table]] = {
    ".tdms": read_tdms,
    ".uff": read_uff,
    ".unv": read_uff,
}
_OLD_BOOK = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"  # of Excel before 2007
_BOOKS = (".xlsx", ".xlsm")


def read_table(path: Path, read: ReadTable) -> Table:
    """The table of a file; of several sheets or files of an archive, the one with most samples, or
    the first of these. Raises `FileError`.
    """
    suffix = path.suffix.lower()
    if not path.is_file():
        return read_text_table(path, read.skip_rows)
    if suffix in ARRAY_SUFFIXES:
        return read_array_table(path)
    if suffix in _WAVEFORMS:
        return _WAVEFORMS[suffix](path)
    start = _start(path)
    if start.startswith(_OLD_BOOK):
        problem = "it is a spreadsheet of Excel before 2007"
        raise FileError(path, None, problem, "save it as .xlsx or CSV")
    if start.startswith(FIRST_LINE.encode()) or suffix == ".lvm":
        return read_labview(path)
    if is_book(path) or suffix in _BOOKS:
        return _longest(path, read_sheets(path, read.skip_rows), read, "sheets")
    if suffix == ".zip" or (suffix not in (".csv", ".txt") and is_archive(path)):
        return _longest(path, read_archive(path, read.skip_rows), read, "files")
    return read_text_table(path, read.skip_rows)


def _start(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(64)


def _longest(path: Path, found: list[Table | FileError], read: ReadTable, noun: str) -> Table:
    """The table of the chosen name, or the longest that can be read."""
    tables = [each for each in found if isinstance(each, Table)]
    named = [each for each in tables if each.part == read.part]
    if named:
        return named[0]
    sizes = [_samples(each, read) for each in tables]
    usable = [each for each, size in zip(tables, sizes, strict=True) if size]
    if not usable:
        names = ", ".join(table.part for table in tables)
        if read.part is not None:
            problem = f"there is no part `{read.part}`"
            raise FileError(path, None, problem, f"the {noun} are: {names}")
        if tables and len(found) > 1:
            problem = f"none of its {noun} {names} has a header with a clock and a known quantity"
            raise FileError(path, None, problem, "choose one by `part` under [read] in a sidecar")
        first = found[0]
        if isinstance(first, FileError):
            raise first
        return first
    chosen = usable[max(range(len(usable)), key=lambda i: _samples(usable[i], read))]
    if len(usable) < 2:
        return chosen
    names = ", ".join(table.part for table in usable)
    note = (
        f"Of the {noun} {names} the longest is used, or the first of the longest: {chosen.part}; "
        "`part` under [read] in a sidecar chooses another."
    )
    return chosen._replace(notes=(note, *chosen.notes))


def _samples(table: Table, read: ReadTable) -> int:
    """The number of samples or bounces in a table; 0 if it cannot be read."""
    try:
        heard = bounces(table) if read.part in (None, table.part) else None
        return len(heard[0]) if heard is not None else samples_of(table, read)
    except FileError:
        return 0
