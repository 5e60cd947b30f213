"""Columns of a table that hold the time and the observed quantity."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from impactjax._record.sidecar import ReadTable
from impactjax._record.table import USUAL_HEADER, Table
from impactjax._sensor.quantity import IMPACT_TIME, TIME, observables, units_of


class Column(NamedTuple):
    """A column of a file: its position, its quantity, and the factor to SI units."""

    position: int
    quantity: str
    factor: float


def columns(table: Table, read: ReadTable) -> tuple[Column | None, Column]:
    """The column of time, if there is one, and that of the observed quantity.

    Raises `FileError`.
    """
    observed = _observed(table, read)
    return None if observed.quantity == IMPACT_TIME else _time(table, read), observed


def unused(table: Table, used: Sequence[Column | None]) -> list[str]:
    """The headers of the columns that are not used."""
    positions = {column.position for column in used if column is not None}
    return [cell for i, cell in enumerate(table.header or ()) if i not in positions]


def _observed(table: Table, read: ReadTable) -> Column:
    if read.column is not None:
        chosen = _chosen(table, read.column, read.quantity, read.unit)
        if chosen.quantity == TIME:
            raise table.wrong_header(
                f"column {chosen.position + 1} is the time", "choose another `column` under [read]"
            )
        return chosen
    if table.header is None:
        raise table.wrong_header(
            "there is no header",
            f"add {USUAL_HEADER}, or describe the file under [read] in a sidecar",
        )
    names = [_name(cell) for cell in table.header]
    if IMPACT_TIME in names:  # then other columns describe the impacts
        return _parsed(table, names.index(IMPACT_TIME))
    others = [i for i, name in enumerate(names) if name != TIME]
    known = [i for i in others if units_of(names[i])]
    if len(known or others) != 1:
        raise table.wrong_header(
            f"the header names {len(known or others)} quantities besides time",
            "choose one by `column` under [read] in a sidecar, or keep one column",
        )
    return _parsed(table, (known or others)[0])


def _time(table: Table, read: ReadTable) -> Column | None:
    if read.time_column is not None:
        chosen = _chosen(table, read.time_column, read.time_unit and TIME, read.time_unit)
        if chosen.quantity != TIME:
            raise table.wrong_header(
                f"column {chosen.position + 1} is not the time", "choose another `time_column`"
            )
        return chosen
    names = [_name(cell) for cell in table.header or ()]
    if TIME in names:
        return _parsed(table, names.index(TIME))
    if read.sample_rate is not None:
        return None
    raise table.wrong_header(
        "there is no column of time", "add one, or `sample_rate` under [read] in a sidecar"
    )


def _chosen(table: Table, column: int | str, quantity: str | None, unit: str | None) -> Column:
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
    return _parsed(table, position)


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


def _name(cell: str) -> str:
    """The quantity in a header."""
    return re.split(r"[\[(]", cell, maxsplit=1)[0].strip().lower()


def _parsed(table: Table, position: int) -> Column:
    """A column from its header, `quantity [unit]` or `quantity (unit)`."""
    assert table.header is not None
    cell = table.header[position]
    match = re.fullmatch(r"[^\[(]+[\[(]([^\[\]()]+)[\])]", cell)
    if match is None:
        raise table.wrong_header(f"column `{cell}` has no unit", f"write {USUAL_HEADER}")
    name, unit = _name(cell), match[1].strip()
    for kind, word, known in (
        ("quantity", name, [TIME, *observables()]),
        ("unit", unit, units_of(name)),
    ):
        if word not in known:
            raise table.wrong_header(f"unknown {kind} `{word}`", f"use one of {', '.join(known)}")
    return Column(position, name, units_of(name)[unit])
