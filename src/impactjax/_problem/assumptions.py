"""Assumptions of a fit that nobody stated, and the values that rest on them.

A record in radians and seconds knows neither a metre nor a kilogram. What it tells of a parameter
with these in its unit rests on the lever and the mass that turn an angle into a length and a force;
a ball's impact times know the metre by gravity only. The unit says how: a parameter in s/m is
inverse to an assumed lever, and its product with the lever, in s/rad, rests on no assumption.
"""

import dataclasses
from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np

from impactjax._parameter import parameter_of
from impactjax._problem.dimensions import Dimensions, dimensions, power, times, unit_of
from impactjax._problem.parameters import Handle, handles
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._sensor.system import System

_SCALES = ("m", "kg")  # a clock gives the second


class Assumption(NamedTuple):
    """A measure of the oscillator that nobody stated.

    - `name`: as under [fixed].
    - `value`, `unit`: what it is taken to be.
    - `reason`: why that.
    """

    name: str
    value: float
    unit: str
    reason: str

    @property
    def sentence(self) -> str:
        """The assumption in words: "length = 0.0512 m (not stated; g / omega_n², ...)"."""
        return f"{self.name} = {self.value:.4g} {self.unit} (not stated; {self.reason})"


class Rest(NamedTuple):
    """On what a value rests.

    - `on`: the names of the assumptions.
    - `powers`: of the assumed values to which it is proportional, by name; `None` if it follows
      them in another way.
    - `unit`: of the value over these powers, which rests on none of them.
    """

    on: tuple[str, ...]
    powers: dict[str, float] | None
    unit: str

    def own_name(self, name: str) -> str:
        """The value over the powers, as text: "alpha·length", "k·length^0.5/mass"."""
        powers = (self.powers or {}).items()
        above = [power(each, -e) for each, e in powers if e < 0]
        below = [power(each, e) for each, e in powers if e > 0]
        top = "·".join([name, *above])
        if not below:
            return top
        return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({'·'.join(below)})"


def assumptions(
    system: System, names: Collection[str], stated: Collection[str]
) -> list[Assumption]:
    """The measures of the oscillator that are neither fitted nor stated but have their default."""
    oscillator = system.model.oscillator
    found = []
    for field in dataclasses.fields(oscillator):
        allowed = parameter_of(field)
        if allowed is None or not allowed.known or field.name in {*names, *stated}:
            continue
        value = getattr(oscillator, field.name)
        if value is None and allowed.unit == "m":
            lever = float(np.asarray(oscillator.lever()))
            reason = "that of a point mass on a light rod, g / omega_n²"
            found.append(Assumption(field.name, lever, "m", reason))
        elif value is not None and field.default is not dataclasses.MISSING:
            number = float(np.asarray(value))
            if number == field.default:
                found.append(Assumption(field.name, number, allowed.unit, "the default"))
    return found


def rests(
    system: System,
    recording: AbstractRecording,
    names: tuple[str, ...],
    assumed: Collection[Assumption],
) -> dict[str, Rest]:
    """The fitted parameters that rest on assumptions, and how.

    Where the record, or a value that was stated, knows the scale itself, all values follow the
    assumption in ways of their own; they cannot be freed from it.
    """
    known = handles(system)
    found = {name: _dimensions_of(name, known, system) for name in known}
    record = dimensions(recording.unit) or {}
    gain_is_free = "gain" in names
    if gain_is_free:  # the record's numbers have no scale, which the gain makes up for
        found |= {"gain": times({}, record, -1.0), "offset": {}, "drift": {}}
    setters = {scale: each for scale in _SCALES for each in assumed if scale in _own(each)}
    anchors = [] if gain_is_free else [record]
    taken = {*names, *(each.name for each in assumed)}
    anchors += [
        found[name]
        for name, handle in known.items()
        if name not in taken and float(np.asarray(handle.get(system))) != 0
    ]
    firm = {scale for scale in setters for each in anchors if each is None or scale in each}
    angle = system.model.oscillator.is_angle()
    units = {**found, "gain": Dimensions()}
    each = {name: _rest(found[name], units[name], setters, firm, angle) for name in names}
    return {name: rest for name, rest in each.items() if rest.on}


def given_words(rest: Rest | None) -> str:
    """Words behind the verdict on a value: ", given length"; none if it rests on nothing."""
    return "" if rest is None else f", given {' and '.join(rest.on)}"


def _rest(
    own: Dimensions | None,
    unit: Dimensions | None,
    setters: Mapping[str, Assumption],
    firm: set[str],
    angle: bool,
) -> Rest:
    if own is None or unit is None:
        return Rest(tuple(each.name for each in setters.values()), None, "")
    on = {s: each for s, each in setters.items() if s in firm or s in own}
    names = tuple(each.name for each in on.values())
    if firm & on.keys():
        return Rest(names, None, "")
    powers, left = {}, unit
    for scale, each in on.items():
        measure = _own(each)
        if angle and scale == "m":
            measure = times(measure, {"rad": 1.0}, -1.0)
        powers[each.name] = own[scale]
        left = times(left, measure, -own[scale])
    return Rest(names, powers, unit_of(left))


def _own(assumption: Assumption) -> Dimensions:
    return dimensions(assumption.unit) or {}


def _dimensions_of(name: str, known: Mapping[str, Handle], system: System) -> Dimensions | None:
    """The dimensions of a parameter, whose unit may have others of the same part as exponents."""
    place = known[name].path[:-1]
    beside = {h.path[-1]: h for h in known.values() if h.path[:-1] == place}
    values = {each: float(np.asarray(h.get(system))) for each, h in beside.items()}
    return dimensions(known[name].allowed.unit, values)
