"""The text of a file."""

from pathlib import Path

from impactjax._measure.file_error import FileError


def read_text(path: Path) -> str:
    """The whole of a UTF-8 file. Raises `FileError`."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        raise FileError(
            path, line, "it is not UTF-8 text", "save it with UTF-8 encoding"
        ) from error
    except OSError as error:
        remedy = "check the name" if isinstance(error, FileNotFoundError) else "check the file"
        raise FileError(path, None, f"it cannot be read ({error.strerror})", remedy) from error
