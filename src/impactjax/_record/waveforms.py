"""Readers of LabVIEW's TDMS and of the universal file format, UFF 58."""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.header import read_header
from impactjax._record.needed import DAMAGE, needed, unreadable_as
from impactjax._record.table import Table
from impactjax._sensor.quantity import QUANTITIES, TIME

_TIME_RESPONSE = 1  # of a function in UFF 58
_MEASURED = {  # quantities by UFF's number of a type of data
    8: "displacement",
    9: "contact force",
    11: "velocity",
    12: "acceleration",
    13: "contact force",
}
_SI = 1  # UFF's number of the system of units


class _Waveform(NamedTuple):
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
    found: list[_Waveform] = []
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
                found.append(_Waveform(header, times, values.astype(float)))
    except (*DAMAGE, struct.error) as error:
        raise unreadable_as(path, "a TDMS file") from error
    return _table(path, found)


def read_uff(path: Path) -> Table:
    """The time responses in the sets 58 of a universal file. Raises `FileError`."""
    pyuff = needed(path, "pyuff", "pyuff")
    try:
        sets = _sets(pyuff.UFF(str(path)))
        found = [_of_set(each) for each in sets if each.get("func_type") == _TIME_RESPONSE]
    except (*DAMAGE, struct.error) as error:
        raise unreadable_as(path, "a UFF file") from error
    return _table(path, [each for each in found if each is not None])


def _sets(file) -> list[dict]:  # noqa: ANN001  of pyuff, which may be absent
    """The sets 58 of a file, each with the number of its system of units, 0 if unknown."""
    kinds = [int(kind) for kind in file.get_set_types()]
    units = [file.read_sets(i) for i, kind in enumerate(kinds) if kind == 164]
    code = int(units[0].get("units_code", 0)) if units else 0
    read = [file.read_sets(i) for i, kind in enumerate(kinds) if kind == 58]
    return [{**each, "system": code} for each in read]


def _of_set(found: dict) -> _Waveform | None:
    times, values = np.asarray(found["x"], float), np.asarray(found["data"])
    if values.dtype.kind not in "biuf" or times.shape != values.shape:
        return None
    quantity = _MEASURED.get(int(found.get("ordinate_spec_data_type", 0)))
    unit = str(found.get("ordinate_axis_units_lab", "")).strip()
    if unit.upper() in ("", "NONE"):
        unit = QUANTITIES[quantity].unit if quantity and found["system"] in (0, _SI) else ""
    name = quantity or str(found.get("ordinate_axis_lab", "")).strip()
    return _Waveform(f"{name} [{unit}]" if unit else name, times, values.astype(float))


def _table(path: Path, found: Sequence[_Waveform]) -> Table:
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
