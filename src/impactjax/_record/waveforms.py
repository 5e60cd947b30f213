"""Channels of measured waveforms as columns, and the reader of LabVIEW's TDMS."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.header import read_header
from impactjax._record.needed import DAMAGE, needed, unreadable_as
from impactjax._record.table import Table
from impactjax._sensor.quantity import TIME

_SILENT = 100  # above every level of a message


class Waveform(NamedTuple):
    """A channel: its header, its times [s], if the file says them, and its values."""

    header: str
    times: np.ndarray | None
    values: np.ndarray


def read_tdms(path: Path) -> Table:
    """The channels of numbers in a TDMS file; groups are parts. Raises `FileError`.

    A channel has the clock of its properties `wf_increment` and `wf_start_offset`, and otherwise
    that of the channel of time in its group.
    """
    nptdms = needed(path, "nptdms", "npTDMS")
    log = needed(path, "nptdms.log", "npTDMS").log_manager
    level = log.log_level
    log.set_level(_SILENT)  # what is wrong with a file is said once
    try:
        file = nptdms.TdmsFile.read(path)
        is_cut = file.file_status.incomplete_final_segment
        groups = {each.name: each.channels() for each in file.groups() if each.channels()}
        found = [
            waveform
            for name, channels in groups.items()
            for channel in channels
            if (waveform := _channel(channel, f"{name}: " if len(groups) > 1 else "")) is not None
        ]
    except DAMAGE as error:
        raise unreadable_as(path, "a TDMS file") from error
    finally:
        log.set_level(level)
    if is_cut:
        raise FileError(path, None, "its last segment is incomplete", "save it anew")
    return table_of_waveforms(path, found)


@runtime_checkable
class _Channel(Protocol):
    """A channel of npTDMS."""

    name: str
    properties: Mapping[str, Any]

    def __getitem__(self, index: slice) -> np.ndarray: ...


def _channel(channel: _Channel, before: str) -> Waveform | None:
    values, properties = np.asarray(channel[:]), channel.properties
    unit = str(properties.get("unit_string", "")).strip()
    if values.dtype.kind == "M" and values.size:
        values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
    if values.dtype.kind not in "biuf" or not values.size:
        return None
    header = f"{before}{channel.name}" + (f" [{unit}]" if unit else "")
    step = float(properties.get("wf_increment", 0) or 0)
    start = float(properties.get("wf_start_offset", 0) or 0)
    times = start + step * np.arange(len(values)) if step > 0 else None
    return Waveform(header, times, values.astype(float))


def table_of_waveforms(path: Path, found: Sequence[Waveform]) -> Table:
    """A table of all channels, each with its clock at the left, and padded to equal length."""
    headers: list[str] = []
    columns: list[np.ndarray] = []
    for each in found:
        if each.times is not None:
            run = read_header(each.header).run
            headers.append(f"{run}: {TIME} [s]" if run else f"{TIME} [s]")
            columns.append(each.times)
        headers.append(each.header)
        columns.append(each.values)
    if not columns:
        remedy = "export the clock and what was observed"
        raise FileError(path, None, "it holds no list of numbers in time", remedy)
    longest = max(map(len, columns))
    padded = [np.pad(each, (0, longest - len(each)), constant_values=np.nan) for each in columns]
    return Table(path, headers, None, padded)
