"""Headers of columns, as instruments and programs write them: name, axis, unit and run."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from impactjax._sensor.quantity import IMPACT_TIME, QUANTITIES, TIME, units_of
from impactjax._sensor.units import usual_unit

FRAME = "frame"  # quantity of a clock that counts the frames of a video
MAGNITUDE = "magnitude"  # in place of an axis: the length of a vector

_LONGEST = 200  # characters of a header that is looked at
_CLOCKS = (
    *("t", "elapsed time", "time elapsed", "seconds elapsed", "timestamp", "time stamp"),
    *("seconds", "milliseconds", "zeit", "temps", "tiempo", "tempo", "tijd", "x value"),
)
_IMPACTS = ("impact times", "bounce time", "bounce times", "onset", "onset time")
_FRAMES = ("frame", "frames", "frame number", "frame no.", "image", "image number", "frame index")
_OTHER_NAMES = {
    **dict.fromkeys((TIME, *_CLOCKS), TIME),
    **dict.fromkeys((IMPACT_TIME, *_IMPACTS), IMPACT_TIME),
    **dict.fromkeys(_FRAMES, FRAME),
}
_IN_THE_NAME = {"seconds elapsed": "s", "seconds": "s", "milliseconds": "ms"}
_AXES = {"x": "x", "y": "y", "z": "z", "vertical": "y", "horizontal": "x"}
_JOINED = re.compile(r"(w|ω|omega|gyro?|a|acc|v)([xyz])")  # a name with its axis, such as wz
_LENGTHS_OF_VECTORS = ("absolute", "magnitude", "resultant", "norm")
_KINEMATIC = ("linear acceleration", "user acceleration")
_NAMELESS = re.compile(  # names that a program gives to a channel
    r"(?:(?:c?daq|dev|mod)\w*\s+)*(?:untitled|channel|chan|ch|ai|signal|data|values?|sensor)?\s*\d*"
)
_BY_UNIT = (  # quantities of columns that are named by an axis or a channel only
    *("displacement", "velocity", "proper acceleration", "angle", "angular velocity"),
    *("angular acceleration", "contact force"),
)
_RUN_BEFORE = re.compile(r"\s*([^:\[\]()]{1,60}?)\s*:\s*(\S.*)", re.DOTALL)
_RUN_AFTER = re.compile(r"(.*[^\s,])[\s,]+\(?((?:data set|run|set|trial)\s*#?\s*\d+)\)?\s*", re.I)
_BRACKETS = re.compile(r"(.*[^\s\[(].*?)[\[(]([^\[\]()]+)[\])]\s*", re.DOTALL)
_AFTER_MARK = re.compile(r"(.*\w)(?:\s*/\s*|\s*,\s*|_)(\S+)\s*", re.DOTALL)


class Header(NamedTuple):
    """A header in its parts.

    - `cell`: header as in the file.
    - `quantity`: observed quantity, time, impact time or frame; `None` if unknown.
    - `name`: its name in lower case, without axis, unit and run.
    - `axis`: axis of a vector, or `MAGNITUDE`; empty if there is none.
    - `unit`: unit as in the file; `None` if there is none.
    - `run`: name of the run or the body that it belongs to; empty if there is none.
    """

    cell: str
    quantity: str | None
    name: str
    axis: str = ""
    unit: str | None = None
    run: str = ""

    @property
    def is_usual(self) -> bool:
        """True if it is written as the documentation asks."""
        return self.quantity == self.name and not self.axis and not self.run

    @property
    def factor(self) -> float | None:
        """The factor of its unit to the SI unit; `None` if the unit is absent or unknown."""
        known = units_of(self.quantity or "")
        return None if self.unit is None else known.get(self.unit, known.get(usual_unit(self.unit)))


def read_header(cell: str) -> Header:
    """A header in its parts."""
    if len(cell) > _LONGEST:
        return Header(cell, None, cell.strip().lower())
    whole = _in_parts(cell, cell, "")
    if whole.quantity is not None:
        return whole
    for pattern, rest, run in ((_RUN_BEFORE, 2, 1), (_RUN_AFTER, 1, 2)):
        match = pattern.fullmatch(cell)
        if match is not None:
            found = _in_parts(cell, match[rest], match[run])
            if found.quantity is not None:
                return found
    return whole


def units_below(headers: Sequence[str], cells: Sequence[str]) -> list[str] | None:
    """Headers with the units in the row below them; `None` if that row does not hold units."""
    if not any(cells) or len(cells) > len(headers):
        return None
    found = [*headers]
    for i, cell in enumerate(cells):
        unit = cell.strip().strip("[]()")
        if unit:
            joined = read_header(f"{headers[i]} [{unit}]")
            if joined.quantity is not None and joined.factor is None:
                return None
            found[i] = joined.cell
    known = [read_header(cell) for cell in found]
    return found if any(each.factor is not None for each in known) else None


def _in_parts(cell: str, text: str, run: str) -> Header:
    for pattern in (_BRACKETS, _AFTER_MARK):
        match = pattern.fullmatch(text)
        if match is not None:
            quantity, name, axis = _quantity(match[1], match[2])
            found = Header(cell, quantity, name, axis, match[2].strip(), run)
            if pattern is _BRACKETS or found.factor is not None:
                return found
    quantity, name, axis = _quantity(text, None)
    return Header(cell, quantity, name, axis, _IN_THE_NAME.get(name), run)


def _names() -> dict[str, str]:
    """The quantity of each name, those that a user has added to `QUANTITIES` included."""
    known = {word: name for name, each in QUANTITIES.items() for word in (name, *each.synonyms)}
    return {**known, **_OTHER_NAMES}


def _quantity(text: str, unit: str | None) -> tuple[str | None, str, str]:
    """The quantity in a header, its name and its axis."""
    name = " ".join(re.sub(r"[_\-–{}()$\\/,]", " ", text).lower().split())
    names = _names()
    if name in names:
        return names[name], name, ""
    words = re.sub(r"\b(?:ch(?:annel)?\s+\w{1,2}(?:\s*[+&]\s*\w{1,2})?|\d+)$", "", name).split()
    axis = ""
    for end in (-1, 0):
        if words and not axis and words[end] in (*_AXES, *_LENGTHS_OF_VECTORS):
            axis = words.pop(end)
    joined = _JOINED.fullmatch(words[-1]) if words and not axis else None
    if joined is not None:
        words[-1], axis = joined.groups()
    axis = _AXES.get(axis, MAGNITUDE) if axis else ""
    short = " ".join(words)
    quantity = names.get(short)
    if quantity == "acceleration" and axis and short not in _KINEMATIC:
        quantity = "proper acceleration"
    if unit is not None and _NAMELESS.fullmatch(short):
        quantity = next((each for each in _BY_UNIT if Header("", each, "", "", unit).factor), None)
    if quantity is None:
        return None, name, ""
    return quantity, short, axis
