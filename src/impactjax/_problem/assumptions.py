"""Assumptions of a fit that the user did not state, and the values that depend on them.

A record in radians and seconds contains no length and no mass. The value of a parameter with m or
kg in its unit then depends on the lever and the mass that turn an angle into a length and a force.
The impact times of a ball contain a length only through gravity. The unit gives the dependence: a
parameter in s/m is inversely proportional to an assumed lever, and its product with the lever, in
s/rad, depends on no assumption. A record in newtons anchors the product of mass and length: with
twice the mass, all lengths are half as large.
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

_ROUNDING = 1e-9  # exponent that counts as zero
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

    Changed base units make up for another assumed value, if the record and the values that are
    stated stay as they are. If there is no such change, values are no longer proportional to powers
    of the assumption, and no product of them is free of it.
    """
    known = handles(system)
    found = {name: _dimensions_of(name, known, system) for name in known}
    record = dimensions(recording.unit) or {}
    gain_is_free = "gain" in names
    if gain_is_free:  # the record's values are then known only up to the factor `gain`
        found |= {"gain": times({}, record, -1.0), "offset": {}, "drift": {}}
    anchors = [] if gain_is_free else [record]
    taken = {*names, *(each.name for each in assumed)}
    anchors += [
        found[name]
        for name, handle in known.items()
        if name not in taken and float(np.asarray(handle.get(system))) != 0
    ]
    changes = _changes(assumed, anchors)
    angle = system.model.oscillator.is_angle()
    units = {**found, "gain": Dimensions()}
    each = {name: _rest(found[name], units[name], assumed, changes, angle) for name in names}
    return {name: rest for name, rest in each.items() if rest.on}


def _changes(
    assumed: Collection[Assumption], anchors: Collection[Dimensions | None]
) -> dict[str, np.ndarray | None]:
    """Relative change of the missing base units that makes up for one of each assumed value, by its
    name. It leaves the other assumed values and all anchors, which are measured or stated, as they
    are; `None` if there is no such change.
    """
    fixed = [_row(each) for each in anchors if each is not None]
    rows = np.array([*fixed, *(_row(_own(each)) for each in assumed)]).reshape(-1, len(_SCALES))
    found: dict[str, np.ndarray | None] = {}
    for i, each in enumerate(assumed):
        wanted = np.zeros(len(rows))
        wanted[len(fixed) + i] = 1.0
        change = np.linalg.lstsq(rows, wanted)[0]
        exact = np.allclose(rows @ change, wanted) and None not in anchors
        found[each.name] = change if exact else None
    return found


def _row(own: Dimensions) -> list[float]:
    return [own.get(scale, 0.0) for scale in _SCALES]


def given_words(rest: Rest | None) -> str:
    """Words after the verdict on a value: ", given length"; empty without assumptions."""
    return "" if rest is None else f", given {' and '.join(rest.on)}"


def _rest(
    own: Dimensions | None,
    unit: Dimensions | None,
    assumed: Collection[Assumption],
    changes: Mapping[str, np.ndarray | None],
    angle: bool,
) -> Rest:
    if own is None or unit is None:
        return Rest(tuple(each.name for each in assumed), None, "")
    powers: dict[str, float] = {}
    loose, left = [], unit
    for each in assumed:
        change = changes[each.name]
        if change is None:
            loose.append(each.name)
        elif abs(exponent := float(np.dot(_row(own), change))) > _ROUNDING:
            powers[each.name] = exponent
            measure = _own(each)
            if angle and "m" in measure:
                measure = times(measure, {"rad": 1.0}, -1.0)
            left = times(left, measure, -exponent)
    if loose:
        return Rest((*loose, *powers), None, "")
    return Rest(tuple(powers), powers, unit_of(left))


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
