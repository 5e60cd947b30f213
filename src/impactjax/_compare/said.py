"""Errors about what a sidecar says."""

import contextlib
from collections.abc import Iterator

from impactjax._record.file_error import FileError
from impactjax._record.read_recording import RecordingFile
from impactjax._record.text import read_text
from impactjax._record.toml_tables import line_of


@contextlib.contextmanager
def refused_in_sidecar(file: RecordingFile | None, key: str) -> Iterator[None]:
    """Turns a `ValueError` about a key of a sidecar into a `FileError` with its line.

    Without a file, the error stays as it is.
    """
    try:
        yield
    except ValueError as error:
        if file is None or file.sidecar_path is None:
            raise
        problem, _, remedy = str(error).rstrip(".?").partition("; ")
        remedy = remedy or "correct it"
        raise sidecar_error(file, key, problem[:1].lower() + problem[1:], remedy) from error


def sidecar_error(file: RecordingFile, key: str, problem: str, remedy: str) -> FileError:
    """An error about a key of a file's sidecar."""
    assert file.sidecar_path is not None
    line = line_of(read_text(file.sidecar_path), key)
    return FileError(file.sidecar_path, line, problem, remedy)
