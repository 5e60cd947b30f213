"""Reader of text files."""

import codecs
import re
from pathlib import Path

from impactjax._record.file_error import FileError

_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")


def read_text(path: Path) -> str:
    """The text of a UTF-8 file. Raises `FileError`."""
    check_is_file(path)
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        raise FileError(
            path, line, "it is not UTF-8 text", "save it with UTF-8 encoding"
        ) from error
    except OSError as error:
        raise unreadable(path, error) from error


def read_any_text(path: Path) -> tuple[str, tuple[str, ...]]:
    """The text of a file of UTF-8, UTF-16 or Windows-1252, and a sentence if it is not UTF-8.

    Raises `FileError`, also for text with control characters, which is none.
    """
    check_is_file(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from error
    return decoded(path, content)


def decoded(path: Path, content: bytes) -> tuple[str, tuple[str, ...]]:
    """The text in some bytes, and a sentence if it is not UTF-8. Raises `FileError`."""
    try:
        return content.decode("utf-8-sig"), ()
    except UnicodeDecodeError as error:
        wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        name, encoding = ("UTF-16", "utf-16") if wide else ("Windows-1252", "cp1252")
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            text = "\0"
        if not _CONTROL.search(text):
            return text, (f"The text is not UTF-8; it was read as {name}.",)
        line = content[: error.start].count(b"\n") + 1
        remedy = "save it with UTF-8 encoding"
        raise FileError(path, line, "it is not UTF-8 text", remedy) from error


def unreadable(path: Path, error: OSError) -> FileError:
    """An error about a file that cannot be opened."""
    remedy = "check the name" if isinstance(error, FileNotFoundError) else "check the file"
    return FileError(path, None, f"it cannot be read ({error.strerror})", remedy)


def check_is_file(path: Path) -> None:
    """Checks that a path is not a pipe or a device. Raises `FileError`."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise FileError(path, None, "it is no ordinary file", "copy what it gives into one")
