"""Headers whose units a program leaves out: Tracker's, and those of phones' loggers."""

from collections.abc import Sequence

from impactjax._record.header import Header, read_header
from impactjax._record.table import Table
from impactjax._sensor.quantity import QUANTITIES, TIME

_AXES = ("x", "y", "z")
_LOGGER_CLOCK = "seconds elapsed"
_LOGGED = {  # quantities in the logger's files with columns x, y, z, by words of their names
    "totalacceleration": "proper acceleration",
    "accelerometeruncalibrated": "proper acceleration",
    "accelerometer": "acceleration",
    "gyroscope": "angular velocity",
}
_OTHERS = ("gravity", "magnet", "orientation", "compass", "location", "baro", "annotation", "wrist")


def read_headers(table: Table) -> tuple[list[Header], list[str]]:
    """The headers of a table, with the units that its program leaves out; and sentences on them."""
    headers = [read_header(cell) for cell in table.header or ()]
    bare = [i for i, each in enumerate(headers) if each.unit is None and each.name in _AXES]
    clocks = [i for i, each in enumerate(headers) if each.quantity == TIME]
    names = {headers[i].name for i in clocks}
    if not bare or table.lines is None:
        return headers, []
    if _LOGGER_CLOCK in names:
        quantity = _logged(table.part or table.path.stem)
        if quantity is None:
            return headers, []
        unit = QUANTITIES[quantity].unit
        said = f"as {quantity} in {unit}, the usual meaning in a file of this name"
    elif names == {"t"} and all(headers[i].unit is None for i in clocks):
        quantity, unit = "displacement", "m"
        for i in clocks:
            headers[i] = headers[i]._replace(unit="s")
        said = "as displacement in m, and time in s"
    else:
        return headers, []
    for i in bare:
        headers[i] = headers[i]._replace(quantity=quantity, axis=headers[i].name, unit=unit)
    return headers, [f"Columns without a unit, {_listed(headers, bare)}, are read {said}."]


def _logged(name: str) -> str | None:
    """The quantity in a file of a phone's logger; acceleration if the name does not say it."""
    plain = "".join(c for c in name.lower() if c.isalpha())
    if any(word in plain for word in _OTHERS):
        return None
    return next((quantity for word, quantity in _LOGGED.items() if word in plain), "acceleration")


def _listed(headers: Sequence[Header], positions: Sequence[int]) -> str:
    return ", ".join(f"`{headers[i].cell}`" for i in positions)
