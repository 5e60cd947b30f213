"""Impact times from a table with a row for each experiment and a column for each bounce."""

import math
import re

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.header import read_header
from impactjax._record.table import Table, number, numbers
from impactjax._sensor.quantity import TIME, units_of
from impactjax._sensor.units import usual_unit

_INSTANT = re.compile(r"(?:bounce|impact|hit|stop|start|split)(?: time)?(?: (\d+))?")
_FLIGHT = re.compile(r"(?:time|flight|flight time|duration|interval|difference) (\d+)")


def is_bounce(cell: str) -> bool:
    """True for the header of the time of one bounce, or of the flight that ends with it."""
    of_bounce = _number(_INSTANT, cell) is not None or _number(_FLIGHT, cell) is not None
    return of_bounce and cell.rstrip().endswith((")", "]"))


def bounces(table: Table) -> tuple[np.ndarray, tuple[str, ...]] | None:
    """The impact times in the first row [s], and sentences on what was read; `None` for a table of
    another layout.

    Columns `Bounce 0 (s)`, `Bounce 1 (s)`, ... or `Start (s)`, `Stop 1 (s)`, ... hold instants;
    columns `Time 1 (s)`, `Time 2 (s)`, ... the durations of successive flights. A zero or an empty
    cell is a bounce that was not heard. Raises `FileError`.
    """
    header = table.header or []
    instants = _ordered(_INSTANT, header)
    flights = _ordered(_FLIGHT, header) if len(table.columns[0]) == 1 else []
    if (len(instants) < 2 and not flights) or _has_clock(header):
        return None
    chosen = instants if len(instants) >= 2 else flights
    values = _first_row(table, chosen)
    said = f"`{header[chosen[0]]}` to `{header[chosen[-1]]}`"
    notes = []
    if len(table.columns[0]) > 1:
        notes.append(f"Of {len(table.columns[0])} rows the first is used.")
    if chosen is instants:
        times = values
        notes.insert(0, f"Impact times are {said}.")
    else:
        if (np.diff(values) >= 0).any():
            problem = f"the flights {said} do not get shorter"
            remedy = "call columns of times `Bounce 0 (s)`, `Bounce 1 (s)`, ..."
            raise table.wrong_header(problem, remedy)
        times = np.concatenate([[0.0], np.cumsum(values)])
        notes.insert(0, f"Impact times are sums of the durations of flights, {said}.")
    if len(times) < 2:
        problem = f"{len(times)} impacts were found in it"
        raise FileError(table.path, None, problem, "a fit needs more, clearly apart")
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if wrong.size:
        i = int(wrong[0])
        problem = f"time does not increase ({times[i + 1]:g} s after {times[i]:g} s)"
        raise FileError(table.path, table.line(0), problem, "correct the times")
    return times, tuple(notes)


def _number(pattern: re.Pattern[str], cell: str) -> int | None:
    name = " ".join(re.split(r"[\[(]", cell, maxsplit=1)[0].lower().split())
    match = pattern.fullmatch(name)
    if match is None:
        return None
    return int((match[1] or ("1" if name.startswith("stop") else "0"))[:9])


def _ordered(pattern: re.Pattern[str], header: list[str]) -> list[int]:
    """Positions of the columns of a kind, in the order of their numbers."""
    found = {i: _number(pattern, cell) for i, cell in enumerate(header)}
    return sorted((i for i, n in found.items() if n is not None), key=lambda i: (found[i], i))


def _has_clock(header: list[str]) -> bool:
    found = [read_header(cell) for cell in header if _number(_FLIGHT, cell) is None]
    return any(each.quantity == TIME for each in found)


def _first_row(table: Table, positions: list[int]) -> np.ndarray:
    """Times in the first row [s], up to the first that was not measured."""
    assert table.header is not None
    units = units_of(TIME)
    values: list[float] = []
    for rank, position in enumerate(positions):
        cell = table.header[position]
        match = re.search(r"[\[(]([^\[\]()]+)[\])]\s*$", cell)
        unit = None if match is None else match[1].strip()
        if unit is None:
            raise table.wrong_header(f"column `{cell}` has no unit", "write `Bounce 1 (s)`")
        factor = units.get(unit, units.get(usual_unit(unit)))
        if factor is None:
            known = ", ".join(units)
            raise table.wrong_header(f"unknown unit `{unit}`", f"use one of {known}")
        first = table.columns[position][0]
        text = first if isinstance(first, str | None) else repr(float(first))
        if text is None or text.strip().lower() in ("", "nan"):
            break
        value = number(text, table.decimal_comma)
        if not math.isfinite(value):
            numbers(table, position)  # raises, with the place
        if value == 0 and rank > 0:
            break
        values.append(value * factor)
    return np.array(values)
