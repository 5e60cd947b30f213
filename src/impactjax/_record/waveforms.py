"""Channels of measured waveforms as columns, and the reader of LabVIEW's TDMS."""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.header import read_header
from impactjax._record.needed import DAMAGE, needed, unreadable_as
from impactjax._record.table import Table
from impactjax._sensor.quantity import TIME


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
    found: list[Waveform] = []
    try:
        groups = [each for each in nptdms.TdmsFile.read(path).groups() if each.channels()]
        for group in groups:
            before = f"{group.name}: " if len(groups) > 1 else ""
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.dtype.kind not in "biuf" or not values.size:
                    continue
                unit = str(channel.properties.get("unit_string", "")).strip()
                header = f"{before}{channel.name}" + (f" [{unit}]" if unit else "")
                step = float(channel.properties.get("wf_increment", 0) or 0)
                start = float(channel.properties.get("wf_start_offset", 0) or 0)
                times = start + step * np.arange(len(values)) if step > 0 else None
                found.append(Waveform(header, times, values.astype(float)))
    except (*DAMAGE, struct.error) as error:
        raise unreadable_as(path, "a TDMS file") from error
    return table_of_waveforms(path, found)


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
