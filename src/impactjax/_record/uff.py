"""Reader of time responses in the universal file format, data sets 58 and 58b."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.needed import unreadable_as
from impactjax._record.table import Table
from impactjax._record.waveforms import Waveform, table_of_waveforms
from impactjax._sensor.quantity import QUANTITIES

_MARK = re.compile(rb"^    -1[ \t]*\r?(?:\n|\Z)", re.MULTILINE)
_RECORDS = 11  # lines before the numbers
_TIME_RESPONSE = 1
_TIME = 17  # number of time among the types of data
_MEASURED = {  # quantities by their number among the types of data
    8: "displacement",
    9: "contact force",
    11: "velocity",
    12: "acceleration",
    13: "contact force",
}
_SI = "1"  # number of the system of units in data set 164
_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d{1,3})?")
_TYPES = {2: "f4", 4: "f8"}  # real numbers; others are complex
_REMEDY = "check that it is complete, or save it anew"


class _Set(NamedTuple):
    """A data set: number of the line of its first record, its first line, and what follows."""

    line: int
    first: bytes
    content: bytes


def read_uff(path: Path) -> Table:
    """The real time responses of a file. Raises `FileError`.

    Source: Universal file formats for modal analysis testing, University of Cincinnati, SDRL.
    """
    sets = list(_sets(path.read_bytes()))
    if not sets:
        raise unreadable_as(path, "a UFF file")
    units = [each.content.split(maxsplit=1)[0] for each in sets if each.first.split()[0] == b"164"]
    is_si = not units or units[0].decode("latin-1") == _SI
    found: list[Waveform] = []
    for each in sets:
        if each.first.split()[0].lower() in (b"58", b"58b"):
            waveform = _waveform(path, each, is_si, len(found) + 1)
            found += [] if waveform is None else [waveform]
    return table_of_waveforms(path, found)


def _sets(content: bytes) -> Iterator[_Set]:
    """The data sets of a file; the length of a binary one is in its first line."""
    position = 0
    while (begin := _MARK.search(content, position)) is not None:
        start = content.find(b"\n", begin.end()) + 1
        if not start:
            return
        first = content[begin.end() : start]
        words, after = first.split(), start
        if len(words) > 4 and words[0].lower() == b"58b" and words[4].isdigit():
            for _ in range(_RECORDS):
                after = content.find(b"\n", after) + 1 or len(content)
            after = min(after + int(words[4][:12]), len(content))
        closing = _MARK.search(content, after)
        end = len(content) if closing is None else closing.start()
        if words:
            yield _Set(content.count(b"\n", 0, start) + 1, first, content[start:end])
        position = len(content) if closing is None else closing.end()


def _waveform(path: Path, found: _Set, is_si: bool, number: int) -> Waveform | None:
    """The time response in a data set; `None` for another function and for complex numbers."""
    lines = found.content.split(b"\n", _RECORDS)
    try:
        kind = int(lines[5][:5])
        data, count, spacing = (int(lines[6][i : i + 10]) for i in (0, 10, 20))
        first, step = (float(lines[6][i : i + 13]) for i in (30, 43))
        abscissa, ordinate = (int(line[:10]) for line in lines[7:9])
    except (ValueError, IndexError) as error:
        problem = "a record of a data set 58 cannot be read"
        raise FileError(path, found.line, problem, _REMEDY) from error
    if kind != _TIME_RESPONSE or abscissa != _TIME or data not in _TYPES:
        return None
    binary = found.first.split()[0].lower() == b"58b"
    rows = (_binary if binary else _text)(path, found, lines[-1], data, count, not spacing)
    times = rows[:, 0] if not spacing else first + step * np.arange(count)
    quantity = _MEASURED.get(ordinate)
    label, unit = (lines[8][i : i + 20].decode("latin-1").strip() for i in (26, 47))
    if unit.upper() in ("", "NONE"):
        unit = QUANTITIES[quantity].unit if quantity and is_si else ""
    name = f"{quantity or label} {number}"
    return Waveform(f"{name} [{unit}]" if unit else name, times, rows[:, -1])


def _text(
    path: Path, found: _Set, content: bytes, data: int, count: int, uneven: bool
) -> np.ndarray:
    """The ordinates, after the abscissas if these are uneven, in a row for each sample."""
    del data
    words = _NUMBER.findall(content)
    width = 2 if uneven else 1
    if len(words) != count * width:
        problem = f"a data set of {count} samples holds {len(words) // width}"
        raise FileError(path, found.line, problem, _REMEDY)
    return np.array([float(word.lower().replace(b"d", b"e")) for word in words]).reshape(-1, width)


def _binary(
    path: Path, found: _Set, content: bytes, data: int, count: int, uneven: bool
) -> np.ndarray:
    words = found.first.split()
    order = {b"1": "<", b"2": ">"}.get(words[1] if len(words) > 2 else b"")
    if order is None or words[2] != b"2":
        problem = "the numbers of a data set 58b are in an unknown format"
        raise FileError(path, found.line, problem, "export it as text (58)")
    fields = [("ordinate", f"{order}{_TYPES[data]}")]
    kind = np.dtype([("abscissa", f"{order}f4"), *fields] if uneven else fields)
    if len(content) < count * kind.itemsize or count < 0:
        problem = f"a data set of {count} samples is cut"
        raise FileError(path, found.line, problem, _REMEDY)
    read = np.frombuffer(content, kind, count)
    return np.stack([read[name].astype(float) for name in kind.names or ()], axis=1)
