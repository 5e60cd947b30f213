"""Readers of other packages, which are installed only if they are asked for."""

import importlib
import struct
import zipfile
import zlib
from pathlib import Path
from types import ModuleType

from impactjax._record.file_error import FileError

DAMAGE = (  # exceptions of such readers for files that are damaged or of an unknown variant
    *(OSError, ValueError, TypeError, LookupError, EOFError, ArithmeticError, MemoryError),
    *(NotImplementedError, AttributeError, AssertionError, RuntimeError, SyntaxError),
    *(struct.error, zlib.error, zipfile.BadZipFile, zipfile.LargeZipFile),
)


def needed(path: Path, module: str, package: str) -> ModuleType:
    """A module of a package that a file needs. Raises `FileError` if it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        problem = f"such files need the package {package}, which is not installed"
        remedy = "install it with `pip install 'impactjax[formats]'`, or export the file as CSV"
        raise FileError(path, None, problem, remedy) from error


def unreadable_as(path: Path, kind: str) -> FileError:
    """An error about a file that a reader does not understand."""
    problem = f"it is not {kind} that can be read"
    return FileError(path, None, problem, "check that it is complete, or save it anew")
