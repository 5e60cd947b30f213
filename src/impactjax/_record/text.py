"""Reader of text files."""

from pathlib import Path

from impactjax._record.file_error import FileError


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


def unreadable(path: Path, error: OSError) -> FileError:
    """An error about a file that cannot be opened."""
    remedy = "check the name" if isinstance(error, FileNotFoundError) else "check the file"
    return FileError(path, None, f"it cannot be read ({error.strerror})", remedy)


def check_is_file(path: Path) -> None:
    """Checks that a path is not a pipe or a device. Raises `FileError`."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise FileError(path, None, "it is no ordinary file", "copy what it gives into one")
