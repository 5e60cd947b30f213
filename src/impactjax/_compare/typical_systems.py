"""Systems with typical values, and the parameters of laws by name."""

from collections.abc import Sequence

import numpy as np

from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import complete
from impactjax._first_look.first_look import FirstLook
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.law import AbstractLaw
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.stop import Stop
from impactjax._parameter import Range
from impactjax._problem.parameters import handles
from impactjax._sensor.sensor import Sensor
from impactjax._sensor.system import Start, System

Law = str | AbstractLaw  # name in the table `LAWS`, or a law object

_CONTACT = 700.0  # natural frequency [rad/s]


def typical_system(oscillator: AbstractOscillator, law: Law) -> System:
    """A system with typical values of initial state and contact."""
    initial = InitialState(np.pi / 4 if oscillator.is_angle() else 0.1)
    look = FirstLook(oscillator, initial, np.zeros(0), np.zeros(0), _CONTACT, False)
    return System(with_law(look, law), initial, Start(0.0), Sensor())


def with_law(look: FirstLook, law: Law) -> ImpactOscillator:
    """The model of a first look with a law. A named law starts from the values of the first look, a
    law object keeps its own.
    """
    if law == NO_LAW:
        return ImpactOscillator(look.oscillator)
    own = LAWS[law](look) if isinstance(law, str) else law
    return ImpactOscillator(look.oscillator, Stop(own))


def parameters(oscillator: AbstractOscillator, laws: Sequence[Law]) -> dict[str, Range]:
    """Ranges of all parameters of motion, contact laws and start, by name."""
    found: dict[str, Range] = {}
    for law in laws:
        known = handles(typical_system(complete(oscillator), law))
        found |= {name: each.allowed for name, each in known.items() if each.path[0] != "sensor"}
    return found
