"""Systems with typical values."""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import numpy as np

from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._first_look.first_look import FirstLook
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.law import AbstractLaw
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.separation import AbstractSeparation
from impactjax._model.stop import Stop
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import Start, System

Law = str | AbstractLaw  # name in the table `LAWS`, or a law object

_CONTACT = 700.0  # natural frequency [rad/s]


class Upper(NamedTuple):
    """A second stop, above: its law, or `None` for that of the lower stop, and its gap."""

    law: Law | None
    gap: float


def typical_system(
    oscillator: AbstractOscillator,
    law: Law,
    upper: Upper | None = None,
    separation: AbstractSeparation | None = None,
) -> System:
    """A system with typical values of initial state and contact."""
    initial = InitialState(np.pi / 4 if oscillator.is_angle() else 0.1)
    look = FirstLook(oscillator, initial, np.zeros(0), np.zeros(0), _CONTACT, False)
    return System(with_law(look, law, upper, separation), initial, Start(0.0), Sensor())


def with_law(
    look: FirstLook,
    law: Law,
    upper: Upper | None = None,
    separation: AbstractSeparation | None = None,
) -> ImpactOscillator:
    """The model of a first look with a law. A named law starts from the values of the first look, a
    law object keeps its own.

    **Arguments:**

    - `upper`: second stop; none if `None`. Free flight has no stop.
    - `separation`: rule for the end of contact, for laws that accept one; each law's own if `None`.
    """
    if law == NO_LAW:
        return ImpactOscillator(look.oscillator)
    lower = Stop(_law(look, law, separation))
    if upper is None:
        return ImpactOscillator(look.oscillator, lower)
    own = _law(look, law if upper.law is None else upper.law, separation)
    return ImpactOscillator(look.oscillator, lower, Stop(own, upper.gap))


def _law(look: FirstLook, law: Law, separation: AbstractSeparation | None) -> AbstractLaw:
    own = LAWS[law](look) if isinstance(law, str) else law
    if separation is None or not takes_separation(own):
        return own
    return dataclasses.replace(own, separation=separation)


def takes_separation(law: eqx.Module) -> bool:
    """True for a law object whose contact may end by either rule."""
    return any(each.name == "separation" and each.init for each in dataclasses.fields(law))
