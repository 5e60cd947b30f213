"""From a file to a recording."""

from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from impactjax._measure.columns import columns
from impactjax._measure.file_error import FileError
from impactjax._measure.quantity import IMPACT_TIME, QUANTITIES, AbstractQuantity
from impactjax._measure.recording import AnyRecording, ImpactTimes, Recording
from impactjax._measure.sidecar import Sidecar, read_sidecar
from impactjax._measure.table import Table, numbers, read_table

_BY_NAME: dict[str, AbstractQuantity] = {quantity.name: quantity for quantity in QUANTITIES}


class File(NamedTuple):
    """A recording and what its sidecar says."""

    path: Path
    recording: AnyRecording
    sidecar: Sidecar
    sidecar_path: Path | None


def read_recording(path: Path, sidecar_path: Path | None = None) -> File:
    """A recording from a CSV file, with the help of the sidecar beside it if there is one.

    The file has a header that names quantity and unit, `time [s], angle [deg]`, or the list of
    impact times, `impact time [s]`; or the sidecar says how to read it.

    Raises `FileError`, whose message is one sentence with file, line and remedy.
    """
    beside = path.parent / f"{path.stem}.toml"
    if sidecar_path is None and beside != path and beside.is_file():
        sidecar_path = beside
    sidecar = Sidecar() if sidecar_path is None else read_sidecar(sidecar_path)
    table = read_table(path, sidecar.read.skip_rows)
    return File(path, _recording(table, sidecar), sidecar, sidecar_path)


def _recording(table: Table, sidecar: Sidecar) -> AnyRecording:
    time, observed = columns(table, sidecar.read)
    values = numbers(table, observed.position) * observed.factor
    if observed.quantity == IMPACT_TIME:
        ts = values
    elif time is not None:
        ts = numbers(table, time.position) * time.factor
    else:
        assert sidecar.read.sample_rate is not None
        ts = np.arange(len(values)) / sidecar.read.sample_rate
    _check_increasing(table, ts)
    inside = _inside(table, sidecar.read.window, ts)
    if observed.quantity == IMPACT_TIME:
        return ImpactTimes(jnp.asarray(ts[inside]))
    if np.ptp(values[inside]) == 0:
        raise FileError(
            table.path,
            None,
            f"the {observed.quantity} is the same in every row",
            "check that it is the right column",
        )
    return Recording(
        jnp.asarray(ts[inside]), jnp.asarray(values[inside]), _BY_NAME[observed.quantity]
    )


def _check_increasing(table: Table, ts: np.ndarray) -> None:
    wrong = np.flatnonzero(np.diff(ts) <= 0)
    if wrong.size:
        i = int(wrong[0]) + 1
        raise FileError(
            table.path,
            table.lines[i],
            f"time does not increase ({ts[i]:g} s after {ts[i - 1]:g} s)",
            "sort the rows by time and delete repeated ones",
        )


def _inside(table: Table, window: tuple[float, float] | None, ts: np.ndarray) -> np.ndarray:
    """Which rows to use."""
    low, high = window or (ts[0], ts[-1])
    inside = (ts >= low) & (ts <= high)
    count = np.count_nonzero(inside)
    if count < 2:
        raise FileError(
            table.path,
            None,
            f"{'one row lies' if count else 'no row lies'} from {low:g} to {high:g} s",
            f"a recording needs more than one, and the file goes from {ts[0]:g} to {ts[-1]:g} s",
        )
    return inside
