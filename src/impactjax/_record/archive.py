"""Reader of the tables in a zip archive, as phones' apps export them."""

import struct
import zipfile
import zlib
from pathlib import Path

from impactjax._record.file_error import FileError
from impactjax._record.needed import unreadable_as
from impactjax._record.table import Table
from impactjax._record.text import decoded
from impactjax._record.text_table import table_of_lines

_TEXTS = (".csv", ".txt", ".tsv", ".dat")
_ABOUT = ("meta/", "__macosx/")  # folders that describe the phone
_LARGEST = 500_000_000  # bytes of an unpacked file
_DAMAGE = (  # exceptions of `zipfile`, also for a password and for an unknown compression
    *(OSError, ValueError, EOFError, RuntimeError, NotImplementedError),
    *(struct.error, zlib.error, zipfile.BadZipFile, zipfile.LargeZipFile),
)
_START = b"PK\x03\x04"
_BOOK = "xl/workbook.xml"


def is_archive(path: Path) -> bool:
    """True for a zip archive with texts in it, and no spreadsheet."""
    return path.is_file() and _starts(path) and not is_book(path)


def is_book(path: Path) -> bool:
    """True for a spreadsheet, which is a zip archive too."""
    if not (path.is_file() and _starts(path)):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return _BOOK in archive.namelist()
    except _DAMAGE:
        return False


def _starts(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(_START)) == _START


def read_archive(path: Path, skip_rows: int) -> list[Table | FileError]:
    """The table of each text in an archive, or an error if it holds none. Raises `FileError`."""
    texts = _texts(path)
    if not texts:
        problem = f"it is an archive without a text ({', '.join(_TEXTS)})"
        raise FileError(path, None, problem, "unpack it, and take the file with the measured rows")
    found: list[Table | FileError] = []
    for name, content in texts.items():
        place, part = Path(f"{path}/{name}"), Path(name).stem
        try:
            text, notes = decoded(place, content)
            table = table_of_lines(place, text.splitlines(), skip_rows, part)
            found.append(table._replace(notes=(*notes, *table.notes)))
        except FileError as error:
            found.append(error)
    return found


def _texts(path: Path) -> dict[str, bytes]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = [each for each in archive.infolist() if _is_text(each)]
            if any(each.file_size > _LARGEST for each in members):
                problem = f"it holds a file of more than {_LARGEST // 1_000_000} MB"
                raise FileError(path, None, problem, "unpack it, and shorten that file")
            return {each.filename: archive.read(each) for each in members}
    except FileError:
        raise
    except _DAMAGE as error:
        raise unreadable_as(path, "a zip archive") from error


def _is_text(member: zipfile.ZipInfo) -> bool:
    name = member.filename.lower()
    about = any(name.startswith(folder) or f"/{folder}" in name for folder in _ABOUT)
    return name.endswith(_TEXTS) and not about and not member.is_dir()
