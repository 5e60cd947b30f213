"""Assumptions of a fit that the user did not state, and the values that depend on them.

A record in radians and seconds contains no length and no mass. The value of a parameter with m or
kg in its unit then depends on the lever and the mass that turn an angle into a length and a force.
The impact times of a ball contain a length only through gravity. The unit gives the dependence: a
parameter in s/m is inversely proportional to an assumed lever, and its product with the lever, in
s/rad, depends on no assumption.
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

_SCALES = ("m", "kg")  # base units that may be missing in a record; time is always measured


class Assumption(NamedTuple):
    """A property of the oscillator whose value was not stated.

    - `name`: parameter, as under [fixed] in a sidecar.
    - `value`, `unit`: assumed value.
    - `reason`: origin of the assumed value.
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
    """Dependence of a value on assumptions.

    - `on`: names of the assumptions.
    - `powers`: exponents of the assumed values to whose product it is proportional, by name; `None`
      if the dependence is another one.
    - `unit`: unit of the value divided by these powers, which depends on no assumption.
    """

    on: tuple[str, ...]
    powers: dict[str, float] | None
    unit: str

    def own_name(self, name: str) -> str:
        """The value divided by the powers, as text: "alpha·length", "k·length^0.5/mass"."""
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
    """The oscillator's properties that are neither fitted nor stated and keep their default."""
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
    """The dependence of each fitted parameter on the assumptions, without those that have none.

    If the record or a stated value fixes the same base unit, values are no longer proportional to
    powers of the assumption, and no product of them is free of it.
    """
    known = handles(system)
    found = {name: _dimensions_of(name, known, system) for name in known}
    record = dimensions(recording.unit) or {}
    gain_is_free = "gain" in names
    if gain_is_free:  # the record's values are then known only up to the factor `gain`
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
    """Words after the verdict on a value: ", given length"; empty without assumptions."""
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
    """The dimensions of a parameter. Exponents in its unit may be parameters of the same part, as
    in "N/m^n".
    """
    place = known[name].path[:-1]
    beside = {h.path[-1]: h for h in known.values() if h.path[:-1] == place}
    values = {each: float(np.asarray(h.get(system))) for each, h in beside.items()}
    return dimensions(known[name].allowed.unit, values)
