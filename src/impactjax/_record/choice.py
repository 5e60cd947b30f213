"""Choice of the observed column among several, by a rule that is said."""

import numpy as np

from impactjax._record.header import MAGNITUDE, Header
from impactjax._record.parts import Part
from impactjax._record.table import USUAL_HEADER, Table, numbers_and_gaps
from impactjax._sensor.quantity import IMPACT_TIME, QUANTITIES, TIME, observables, units_of

_RANKS = (  # a coordinate shows more than its rates, and motion more than force
    ("angle", "displacement"),
    ("angular velocity", "velocity"),
    ("angular acceleration", "acceleration"),
    ("proper acceleration",),
    ("contact force",),
)


def preferred(table: Table, part: Part, notes: list[str]) -> int:
    """The position of the observed column of a part.

    Impact times come first, then a coordinate, its rate, its acceleration, and the force. Of
    several columns of one quantity the one that varies most about a straight line is chosen; the
    length of a vector, which has lost its sign, only without the axes. Raises `FileError`.
    """
    quantities = {i: part.headers[i].quantity for i in part.known}
    impacts = [i for i, quantity in quantities.items() if quantity == IMPACT_TIME]
    if impacts:
        return impacts[0]
    rank = next((each for each in _RANKS if set(each) & set(quantities.values())), ())
    found = [i for i in part.known if quantities[i] in rank] or part.values
    different = len({quantities.get(i, i) for i in found})
    if different != 1:
        raise table.wrong_header(
            f"the header names {different} quantities besides time",
            "choose one by `column` under [read] in a sidecar, or keep one column",
        )
    signed = [i for i in found if part.headers[i].axis != MAGNITUDE]
    found = signed or found
    factors = {i: factor_of(table, part.headers[i]) for i in found}
    chosen = max(found, key=lambda i: _variation(table, i) * factors[i]) if found[1:] else found[0]
    header = part.headers[chosen]
    if found[1:]:
        names = ", ".join(f"`{part.headers[i].cell}`" for i in found)
        notes.append(
            f"Of {names} the one that varies most about a straight line is used: `{header.cell}`; "
            "`column` under [read] in a sidecar chooses another."
        )
    if not header.is_usual and header.unit is not None:
        notes.append(f"`{header.cell}` is read as {header.quantity}.")
    return chosen


def factor_of(table: Table, header: Header) -> float:
    """The factor of a column to the SI unit. Raises `FileError` if its header does not say it."""
    if header.unit is None:
        raise table.wrong_header(f"column `{header.cell}` has no unit", f"write {USUAL_HEADER}")
    if header.quantity is None or not units_of(header.quantity):
        known = ", ".join([TIME, *observables()])
        raise table.wrong_header(f"unknown quantity `{header.name}`", f"use one of {known}")
    if header.factor is None:
        remedy = f"use one of {', '.join(units_of(header.quantity))}"
        if header.quantity in QUANTITIES:
            remedy += ", or describe the column under [read], with its `gain` under [sensor]"
        raise table.wrong_header(f"unknown unit `{header.unit}`", remedy)
    return header.factor


def _variation(table: Table, position: int) -> float:
    """Standard deviation of a column about a straight line through its rows."""
    values = numbers_and_gaps(table, position)
    rows = np.flatnonzero(np.isfinite(values))
    if len(rows) < 3:
        return 0.0
    line = np.polyfit(rows, values[rows], 1)
    return float(np.std(values[rows] - np.polyval(line, rows)))
