"""Columns of a table that hold the time and the observed quantity."""

from typing import NamedTuple

from impactjax._record.choice import factor_of, preferred
from impactjax._record.header import read_header
from impactjax._record.parts import Part, longest, parts, samples
from impactjax._record.sidecar import ReadTable
from impactjax._record.table import USUAL_HEADER, Table, number
from impactjax._record.unitless import read_headers
from impactjax._sensor.quantity import IMPACT_TIME, TIME, units_of

_SINCE_1970 = (1e9, 2e9)  # [s], from 2001 to 2033
_TICKS = (1.0, 1e-3, 1e-6, 1e-9)  # [s], of clocks that count from 1970


class Column(NamedTuple):
    """A column of a file: its position, its quantity, and the factor to SI units."""

    position: int
    quantity: str
    factor: float


class Columns(NamedTuple):
    """The columns to read.

    - `time`: column of time; `None` if there is none.
    - `observed`: column of the observed quantity.
    - `notes`: sentences on how they were chosen, and on those that are not used.
    """

    time: Column | None
    observed: Column
    notes: list[str]


def columns(table: Table, read: ReadTable, base: int | str | None = None) -> Columns:
    """The columns of time, if there is one, and of the observed quantity, which is not that of the
    `base`. Raises `FileError`.
    """
    notes: list[str] = []
    part = _part(table, read, notes)
    moved = set() if base is None else {_position(table, base)}
    if part is not None:
        part = part._replace(values=[i for i in part.values if i not in moved])
    observed = _observed(table, part, read, notes)
    time = None if observed.quantity == IMPACT_TIME else _time(table, part, read)
    if read.column is not None:
        return Columns(time, observed, [])
    used = moved | {column.position for column in (time, observed) if column is not None}
    left = [f"`{cell}`" for i, cell in enumerate(table.header or ()) if i not in used and cell]
    if left:
        notes.append(f"Of the file, {', '.join(left)} is not used.")
    return Columns(time, observed, notes)


def samples_of(table: Table, read: ReadTable) -> int:
    """The number of samples of an observed quantity. Raises `FileError` like `columns`."""
    part = _part(table, read, [])
    if part is None:
        return 0
    _time(table, part, read)
    return samples(table, part)


def _part(table: Table, read: ReadTable, notes: list[str]) -> Part | None:
    """The run of the chosen column or name, or the longest; `None` without a header."""
    if table.header is None:
        return None
    headers, said = read_headers(table)
    found = parts(table, headers)
    notes.extend(said)
    if read.column is not None:
        position = _position(table, read.column)
        return next(part for part in found if position in part.headers)
    names = [part.name for part in found]
    if read.part is not None and read.part != table.part:
        if read.part not in names:
            problem = f"there is no part `{read.part}`"
            raise table.wrong_header(problem, f"the parts are: {', '.join(names)}")
        return found[names.index(read.part)]
    complete = [part for part in found if part.known and (part.clocks or read.sample_rate)]
    if len(complete) < 2:
        return (complete or found)[0]
    chosen = longest(table, complete)
    notes.append(
        f"Of the parts {', '.join(part.name for part in complete)} the longest is used, or the "
        f"first of the longest: {chosen.name}; `part` under [read] in a sidecar chooses another."
    )
    return chosen


def _observed(table: Table, part: Part | None, read: ReadTable, notes: list[str]) -> Column:
    if read.column is not None:
        chosen = _chosen(table, part, read.column, read.quantity, read.unit)
        if chosen.quantity == TIME:
            raise table.wrong_header(
                f"column {chosen.position + 1} is the time", "choose another `column` under [read]"
            )
        return chosen
    if part is None:
        raise table.wrong_header(
            "there is no header",
            f"add {USUAL_HEADER}, or describe the file under [read] in a sidecar",
        )
    return _described(table, part, preferred(table, part, notes))


def _time(table: Table, part: Part | None, read: ReadTable) -> Column | None:
    if read.time_column is not None:
        if read.frame_rate is not None and read.time_unit is None:
            return Column(_position(table, read.time_column), TIME, 1 / read.frame_rate)
        chosen = _chosen(table, part, read.time_column, read.time_unit and TIME, read.time_unit)
        if chosen.quantity != TIME:
            raise table.wrong_header(
                f"column {chosen.position + 1} is not the time", "choose another `time_column`"
            )
        return chosen
    clocks = [] if part is None else part.clocks
    times = [i for i in clocks if part is not None and part.headers[i].quantity == TIME]
    if part is not None and times:
        return _clock(table, part, times)
    if clocks and read.frame_rate is not None:
        return Column(clocks[0], TIME, 1 / read.frame_rate)
    if read.sample_rate is not None:
        return None
    if clocks and part is not None:
        problem = f"its clock `{part.headers[clocks[0]].cell}` counts frames"
        raise table.wrong_header(problem, "add `frame_rate` [Hz] under [read] in a sidecar")
    raise table.wrong_header(
        "there is no column of time", "add one, or `sample_rate` under [read] in a sidecar"
    )


def _clock(table: Table, part: Part, times: list[int]) -> Column:
    """The first clock with a unit, or one that counts from 1970."""
    for i in times:
        if part.headers[i].factor is not None:
            return _described(table, part, i)
    for i in times:
        first = table.columns[i][0] if part.headers[i].unit is None else None
        value = number(first, table.decimal_comma) if isinstance(first, str) else first
        for tick in _TICKS:
            if value is not None and _SINCE_1970[0] < value * tick < _SINCE_1970[1]:
                return Column(i, TIME, tick)
    return _described(table, part, times[0])


def _described(table: Table, part: Part, position: int) -> Column:
    """A column that its header describes."""
    header = part.headers[position]
    factor = factor_of(table, header)
    assert header.quantity is not None
    return Column(position, header.quantity, factor)


def _chosen(
    table: Table, part: Part | None, column: int | str, quantity: str | None, unit: str | None
) -> Column:
    """A column chosen by the sidecar. Quantity and unit come from its header, unless the sidecar
    states them.
    """
    position = _position(table, column)
    if quantity is not None and unit is not None:
        return Column(position, quantity, units_of(quantity)[unit])
    if table.header is None:
        raise table.wrong_header(
            f"no header says what column {position + 1} holds",
            "say it under [read] in the sidecar, with its unit",
        )
    header = read_header(table.header[position])
    if part is not None and position in part.headers:
        header = part.headers[position]
    if quantity is not None:  # with the unit of the header
        header = header._replace(quantity=quantity)
    factor = factor_of(table, header)
    assert header.quantity is not None
    return Column(position, header.quantity, factor)


def _position(table: Table, column: int | str) -> int:
    """Position of a column given by its name or, counted from 1, its number."""
    if isinstance(column, int):
        width = len(table.columns)
        if not 1 <= column <= width:
            raise table.wrong_header(
                f"there is no column {column}", f"the sidecar can choose from 1 to {width}"
            )
        return column - 1
    if column not in (table.header or ()):
        names = ", ".join(table.header) if table.header else "none, there is no header"
        raise table.wrong_header(f"there is no column `{column}`", f"the columns are: {names}")
    assert table.header is not None
    return table.header.index(column)
