"""The reader of recordings: file → recording."""

from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import msgspec
import numpy as np

from impactjax._first_look.first_look import noise_size
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._record.averaging import MOST, averaged, bent, blurs, group_size
from impactjax._record.bounces import bounces
from impactjax._record.clipping import clipped
from impactjax._record.columns import columns
from impactjax._record.file_error import FileError
from impactjax._record.impact_times import ImpactTimes
from impactjax._record.missed_impacts import heard
from impactjax._record.onsets import read_onsets
from impactjax._record.outliers import outliers
from impactjax._record.recording import Recording
from impactjax._record.sidecar import Sidecar, read_sidecar
from impactjax._record.table import Table, numbers, numbers_and_gaps
from impactjax._record.tables import read_table
from impactjax._sensor.abstract_quantity import AbstractQuantity
from impactjax._sensor.quantity import IMPACT_TIME, QUANTITIES

_MANY = 4  # most times to list individually
_FARTHEST = 1e15  # [s], later times are no times
_OTHER_RATE = 0.01  # relative difference of a stated rate from that of the clock
_SINCE_A_DATE = 1e9  # [s], later times count from 1904, 1970 or another date


class RecordingFile(NamedTuple):
    """A recording from a file, with its sidecar.

    - `notes`: sentences on columns chosen, and on samples left out, filled in or averaged.
    """

    path: Path
    recording: AbstractRecording
    sidecar: Sidecar
    sidecar_path: Path | None
    notes: tuple[str, ...] = ()


def read_recording(path: str | Path, sidecar_path: str | Path | None = None) -> RecordingFile:
    """A recording from a file, and its sidecar if there is one.

    The file may be text (commas, semicolons, tabs or blanks between columns), NumPy, MATLAB, HDF5,
    NetCDF, a spreadsheet, TDMS, LVM, UFF 58, or a zip archive of texts. Its header gives quantity
    and unit of the columns, `time [s], angle [deg]`, or of a list of impact times, `impact time
    [s]`, by these or other usual names; otherwise the sidecar describes them. In a WAV file the
    onsets are impact times. Of several columns, runs or sheets one is chosen by a rule. Empty,
    clipped and missed observations are not valid. The choice and they are mentioned in `notes`.

    **Arguments:**

    - `path`: file.
    - `sidecar_path`: TOML file that describes it; by default NAME.toml beside it, if that exists.

    Raises `FileError`, whose message is one sentence with file, line and remedy.
    """
    path = Path(path)
    sidecar_path = _beside(path) if sidecar_path is None else Path(sidecar_path)
    sidecar = Sidecar() if sidecar_path is None else read_sidecar(sidecar_path)
    if path.suffix.lower() == ".wav":
        recording, notes = _impact_times(path, read_onsets(path), sidecar)
    else:
        recording, notes = _recording(read_table(path, sidecar.read), sidecar)
    return RecordingFile(path, recording, sidecar, sidecar_path, tuple(notes))


def read_base(file: RecordingFile) -> RecordingFile:
    """The motion of the base that [base] in a file's sidecar names: a column of the same file, or
    of another one, which its own sidecar may describe. Raises `FileError`.
    """
    path, sidecar, base = file.path, file.sidecar, file.sidecar.base
    if base.recording is not None:
        assert file.sidecar_path is not None
        path = file.sidecar_path.parent / base.recording
        own = _beside(path)
        sidecar = Sidecar() if own is None else read_sidecar(own)
    read = sidecar.read
    if base.column is not None:
        named = {"column": base.column, "quantity": base.quantity, "unit": base.unit}
        read = msgspec.structs.replace(read, **named)
    sidecar = Sidecar(read=read)
    recording, notes = _recording(read_table(path, read), sidecar)
    return RecordingFile(path, recording, sidecar, None, tuple(notes))


def _beside(path: Path) -> Path | None:
    """The sidecar NAME.toml beside a file, if there is one."""
    found = path.parent / f"{path.stem}.toml"
    return found if found != path and found.is_file() else None


def _recording(table: Table, sidecar: Sidecar) -> tuple[AbstractRecording, list[str]]:
    read = sidecar.read
    whole = read.column is None and read.part in (None, table.part)
    heard_of = bounces(table) if whole else None
    if heard_of is not None:
        times, said = heard_of
        recording, notes = _impact_times(table.path, times, sidecar)
        return recording, [*table.notes, *said, *notes]
    base = sidecar.base.column if sidecar.base.recording is None else None
    time, observed, chosen = columns(table, read, base)
    own = [observed.position] + ([] if time is None else [time.position])
    table = table.without_empty(own)
    if not len(table.columns[0]):
        problem = f"0 usable values are left in column {observed.position + 1}"
        raise FileError(table.path, None, problem, "check that it is the right column")
    if observed.quantity == IMPACT_TIME:
        times = numbers(table, observed.position) * observed.factor
        _check_increasing(table, times)
        recording, notes = _impact_times(table.path, times, sidecar)
        return recording, [*table.notes, *chosen, *notes]
    values = numbers_and_gaps(table, observed.position) * observed.factor
    if time is not None:
        ts, since = _from_zero(numbers(table, time.position), time.factor)
    else:
        assert read.sample_rate is not None
        ts, since = np.arange(len(values)) / read.sample_rate, []
    _check_increasing(table, ts)
    _check_rate(table, ts, read.sample_rate)
    inside = _inside(table.path, read.window, ts, "row")
    quantity = QUANTITIES[observed.quantity]
    recording, notes = _samples(table.path, quantity, ts[inside], values[inside], sidecar)
    return recording, [*table.notes, *chosen, *since, *notes]


def _from_zero(ticks: np.ndarray, factor: float) -> tuple[np.ndarray, list[str]]:
    """Times [s]; those of a clock that counts from a date begin at zero, with a sentence on it."""
    if ticks[0] * factor < _SINCE_A_DATE:
        return ticks * factor, []
    said = "The clock counts from a date; the first sample is at 0 s."
    return (ticks - ticks[0]) * factor, [said]


def _impact_times(path: Path, times: np.ndarray, sidecar: Sidecar) -> tuple[ImpactTimes, list[str]]:
    if len(times) < 2:
        problem = f"{len(times)} impacts were found in it"
        raise FileError(path, None, problem, "a fit needs more, clearly apart")
    found = heard(times[_inside(path, sidecar.read.window, times, "impact")])
    notes = []
    if found.false.size:
        times_said = _listed(found.false)
        notes.append(f"No impact belongs to what was heard at {times_said}; it is left out.")
    if not found.valid.all():
        times_said = _listed(found.times[~found.valid])
        notes.append(f"An impact was not heard near {times_said}; it is counted, but not fitted.")
    return ImpactTimes(jnp.asarray(found.times), jnp.asarray(found.valid)), notes


def _samples(
    path: Path, quantity: AbstractQuantity, ts: np.ndarray, values: np.ndarray, sidecar: Sidecar
) -> tuple[Recording, list[str]]:
    notes = []
    valid = np.isfinite(values)
    if not valid.all():
        notes.append(f"{count_of(~valid, 'sample')} empty and left out.")
    beyond = clipped(values, sidecar.sensor.clip)
    if beyond.any():
        notes.append(f"{count_of(beyond, 'sample')} clipped and left out.")
    valid &= ~beyond
    wrong = outliers(values, valid, quantity)
    if wrong.any():
        notes.append(f"{count_of(wrong, 'sample')} far from those beside, and left out.")
    valid &= ~wrong
    if np.count_nonzero(valid) < 2:
        problem = f"{np.count_nonzero(valid)} usable values are left"
        raise FileError(path, None, problem, "check that it is the right column")
    if np.ptp(values[valid]) == 0:
        problem = f"the {quantity.name} is the same in every row"
        raise FileError(path, None, problem, "check that it is the right column")
    used = slice(np.flatnonzero(valid)[0], np.flatnonzero(valid)[-1] + 1)
    ts, values, valid = ts[used], values[used], valid[used]
    size = group_size(len(ts))
    if size > 1:
        if blurs(values, size):
            problem = f"its {len(ts)} rows are too many to fit and too varied to average"
            raise FileError(path, None, problem, "choose a `window` under [read] in a sidecar")
        notes.append(f"{len(ts)} samples were averaged in groups of {size}, to at most {MOST}.")
        noise = noise_size(values[valid])
        ts, _ = averaged(ts, np.ones(len(ts), bool), size)
        values, valid = averaged(values, valid, size)
        wrong = valid & bent(values, size, noise)
        if wrong.any():
            notes.append(f"{count_of(wrong, 'mean')} left out, where the motion bends fast.")
        valid &= ~wrong
    return Recording(jnp.asarray(ts), jnp.asarray(values), quantity, jnp.asarray(valid)), notes


def count_of(which: np.ndarray, noun: str) -> str:
    """Number of those marked, with a verb: "14 of 1401 samples are"."""
    number = np.count_nonzero(which)
    return f"{number} of {len(which)} {noun}s {'is' if number == 1 else 'are'}"


def _listed(times: np.ndarray) -> str:
    said = ", ".join(f"{time:.3f}" for time in times[:_MANY])
    return f"{said} s" if len(times) <= _MANY else f"{said}, … s ({len(times)} times)"


def _check_rate(table: Table, ts: np.ndarray, stated: float | None) -> None:
    """Refuses a stated rate beside a clock of another rate. Of a coarse clock the mean interval
    tells the rate, of one with gaps the median.
    """
    if stated is None or len(ts) < 2:
        return
    intervals = np.diff(ts)
    rates = 1 / np.array([np.mean(intervals), np.median(intervals)])
    if np.min(np.abs(stated / rates - 1)) > _OTHER_RATE:
        problem = f"its clock has {rates[0]:.5g} samples a second, but `sample_rate` is {stated:g}"
        raise FileError(
            table.path, None, problem, "correct one of them, or leave `sample_rate` out"
        )


def _check_increasing(table: Table, ts: np.ndarray) -> None:
    far = np.flatnonzero(np.abs(ts) > _FARTHEST)
    if far.size:
        i = int(far[0])
        remedy = "correct the clock or its unit"
        raise FileError(table.path, table.line(i), f"time is {ts[i]:g} s", remedy)
    wrong = np.flatnonzero(np.diff(ts) <= 0)
    if wrong.size:
        i = int(wrong[0]) + 1
        raise FileError(
            table.path,
            table.line(i),
            f"time does not increase ({ts[i]:g} s after {ts[i - 1]:g} s)",
            "sort the rows by time and delete repeated ones",
        )


def _inside(
    path: Path, window: tuple[float, float] | None, ts: np.ndarray, noun: str
) -> np.ndarray:
    """Mask of the rows inside the window. Raises `FileError` if there are fewer than two."""
    low, high = window or (ts[0], ts[-1])
    inside = (ts >= low) & (ts <= high)
    count = np.count_nonzero(inside)
    if count < 2:
        raise FileError(
            path,
            None,
            f"{f'one {noun} lies' if count else f'no {noun} lies'} from {low:g} to {high:g} s",
            f"a recording needs more than one, and the file goes from {ts[0]:g} to {ts[-1]:g} s",
        )
    return inside
