"""The folder of a study: `study.json`, then one file for each chunk of lanes.

A file is written under a temporary name, flushed to the disk, and renamed, so that at any moment
each file is complete or absent. A chunk is a NumPy file (`.npy`) of records, one for each lane,
followed by a digest of its content, of its number and of `study.json`: a chunk that is damaged, has
changed its place or belongs to another study is noticed.
"""

import contextlib
import hashlib
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Shaped

from impactjax._study.study_error import StudyError

Records: TypeAlias = Shaped[np.ndarray, " lanes"]  # a field for each parameter and result

MANIFEST = "study.json"
_DRAFT = ".partial"  # suffix of files that are being written
_NPY_VERSION = (3, 0)  # names in UTF-8
_DIGEST = hashlib.sha256().digest_size


class Folder(NamedTuple):
    """A folder and the digest of its `study.json`."""

    path: Path
    identity: bytes

    def chunk(self, number: int) -> Path:
        """The file of a chunk."""
        return self.path / f"chunk-{number:06d}.npy"

    def read(self, number: int) -> Records | None:
        """The records of a chunk; `None` if the file is damaged or does not belong here.

        **Raises** `StudyError` if it cannot be read at all.
        """
        content = read(self.chunk(number))
        body, seal = content[:-_DIGEST], content[-_DIGEST:]
        if seal != self._seal(number, body):
            return None
        return np.load(io.BytesIO(body), allow_pickle=False)

    def write(self, number: int, records: Records) -> None:
        """Writes a chunk, or raises `StudyError` without a trace of it."""
        buffer = io.BytesIO()
        np.lib.format.write_array(buffer, records, _NPY_VERSION, allow_pickle=False)
        body = buffer.getvalue()
        write(self.chunk(number), body + self._seal(number, body))

    def _seal(self, number: int, body: bytes) -> bytes:
        digest = hashlib.sha256(self.identity + number.to_bytes(8))
        digest.update(body)
        return digest.digest()


def folder_of(path: Path) -> Folder:
    """The folder of a study that has been begun. Raises `StudyError` if it cannot be read."""
    return Folder(path, hashlib.sha256(read(path / MANIFEST)).digest())


def write(path: Path, content: bytes) -> None:
    """Writes a file at once. Raises `StudyError` if the system refuses."""
    draft = path.with_name(path.name + _DRAFT)
    try:
        try:
            with draft.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            draft.replace(path)
            _flush_names(path.parent)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise StudyError(
            f"{path} cannot be written ({error.strerror}); make room or permit it, and run the "
            "study again: it goes on from the chunks that it has."
        ) from error


def read(path: Path) -> bytes:
    """The content of a file. Raises `StudyError` if the system refuses."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise StudyError(
            f"{path} cannot be read ({error.strerror}); name the folder of a study."
        ) from error


@contextlib.contextmanager
def alone(path: Path) -> Iterator[None]:
    """Creates a folder, clears drafts from it, and keeps other processes from writing into it.

    The lock ends with the process, however that ends. Where the system has no such locks there is
    none. **Raises** `StudyError` if another process writes into the folder, if it has files but no
    study, or cannot be used.
    """
    handle = _opened(path)
    try:
        _lock(path, handle)
        _clear(path)
        yield
    finally:
        if handle is not None:
            os.close(handle)


def _opened(path: Path) -> int | None:
    """A handle of a folder, which is created if need be; `None` where folders have no handles."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        return os.open(path, os.O_RDONLY) if os.name == "posix" else None
    except OSError as error:
        raise StudyError(
            f"{path} cannot be the folder of a study ({error.strerror}); name another."
        ) from error


def _lock(path: Path, handle: int | None) -> None:
    if handle is None:
        return
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise StudyError(
            f"Another process writes into {path}; wait for it, or name another folder."
        ) from error
    except OSError:  # a file system without locks
        return


def _clear(path: Path) -> None:
    """Deletes drafts that a killed process has left."""
    try:
        for draft in path.glob(f"*{_DRAFT}"):
            draft.unlink()
        strange = not (path / MANIFEST).exists() and any(path.iterdir())
    except OSError as error:
        raise StudyError(
            f"{path} cannot be used ({error.strerror}); permit it, or name another folder."
        ) from error
    if strange:
        raise StudyError(f"{path} has files but no {MANIFEST}; name a new folder for a study.")


def _flush_names(folder: Path) -> None:
    """Flushes the names of a folder's files to the disk."""
    handle = _opened(folder)
    if handle is not None:
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
