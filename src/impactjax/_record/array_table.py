"""Reader of files with named arrays: NumPy, MATLAB, HDF5 and NetCDF."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.needed import DAMAGE, unreadable_as
from impactjax._record.table import Table

_Arrays = dict[str, Any]


def read_array_table(path: Path) -> Table:
    """The arrays of numbers in a file as columns by their names.

    A unit that HDF5 or NetCDF stores with an array becomes part of its name, `angle [deg]`. The
    columns of a matrix `x` are called `x 1`, `x 2`, ... Arrays shorter than the longest are left
    out. Raises `FileError`.
    """
    arrays = _arrays(path)
    columns: dict[str, np.ndarray] = {}
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.dtype.kind in "biuf" and array.size:
            columns |= _columns(name, np.squeeze(array))
    if not columns:
        held = f"only {', '.join(arrays)}" if arrays else "nothing"
        remedy = "save the clock and what was observed as arrays"
        raise FileError(path, None, f"it holds no list of numbers but {held}", remedy)
    longest = max(map(len, columns.values()))
    kept = {name: column for name, column in columns.items() if len(column) == longest}
    return Table(path, list(kept), None, list(kept.values()))


def _columns(name: str, array: np.ndarray) -> dict[str, np.ndarray]:
    if array.ndim == 1:
        return {name: array}
    if array.ndim == 2 and min(array.shape) <= 64:
        rows = array if array.shape[0] < array.shape[1] else array.T
        return {f"{name} {i}": row for i, row in enumerate(rows, start=1)}
    return {}


def _arrays(path: Path) -> _Arrays:
    """All variables in a file, by name."""
    with path.open("rb") as file:
        start = file.read(8)
    is_hdf5 = start == b"\x89HDF\r\n\x1a\n" or _is_matlab_73(path)
    kind, read = ("HDF5", _hdf5) if is_hdf5 else _READERS.get(path.suffix.lower(), ("HDF5", _hdf5))
    try:
        return read(path)
    except DAMAGE as error:
        raise unreadable_as(path, f"a {kind} file") from error


def _is_matlab_73(path: Path) -> bool:
    """True for a MATLAB 7.3 file, which is HDF5 after a header of 512 bytes."""
    with path.open("rb") as file:
        return file.read(520)[512:] == b"\x89HDF\r\n\x1a\n"


def _npz(path: Path) -> _Arrays:
    with path.open("rb") as file:
        loaded = np.load(file, allow_pickle=False)
        return {path.stem: loaded} if isinstance(loaded, np.ndarray) else dict(loaded)


def _matlab(path: Path) -> _Arrays:
    from scipy import io  # imported only when needed

    try:
        held = io.loadmat(path)
    except io.matlab.MatReadError as error:
        raise ValueError(str(error)) from error
    return {name: array for name, array in held.items() if not name.startswith("__")}


def _netcdf(path: Path) -> _Arrays:
    from scipy import io

    with io.netcdf_file(path, mmap=False) as file:
        return {_named(name, vars(v)): v.data.copy() for name, v in file.variables.items()}


def _hdf5(path: Path) -> _Arrays:
    import h5py

    found: _Arrays = {}

    def keep(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf":
            found[_named(name, item.attrs)] = item[()]

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


def _named(name: str, attributes: Mapping[str, Any]) -> str:
    """A name with the unit that is stored beside the array."""
    unit = attributes.get("units")
    text = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else unit
    return f"{name} [{text}]" if isinstance(text, str) and text.strip() else name


_READERS: dict[str, tuple[str, Callable[[Path], _Arrays]]] = {
    ".npz": ("NumPy", _npz),
    ".npy": ("NumPy", _npz),
    ".mat": ("MATLAB", _matlab),
    ".nc": ("NetCDF", _netcdf),
    ".h5": ("HDF5", _hdf5),
    ".hdf5": ("HDF5", _hdf5),
}
ARRAY_SUFFIXES = frozenset(_READERS)
