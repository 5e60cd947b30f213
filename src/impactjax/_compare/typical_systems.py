"""Systems with typical values, and the parameters that a name on the command line may mean."""

from collections.abc import Iterable, Mapping

import numpy as np

from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._first_look.first_estimates import FirstEstimates
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._model.stop import Stop
from impactjax._parameter import Range
from impactjax._problem.parameters import Start, System, handles
from impactjax._sensor.sensor import Sensor

_CONTACT = 700.0  # natural frequency [rad/s]
_OPTIONAL = {"length": 1.0}  # what an oscillator only has if it is known


def typical_system(oscillator: str, law: str, known: Mapping[str, float], dry: bool) -> System:
    """A system with typical values of what is not known."""
    moving = OSCILLATORS[oscillator](known, dry)
    initial = InitialState(np.pi / 4 if moving.is_angle() else 0.1)
    seen = FirstEstimates(moving, initial, np.zeros(0), np.zeros(0), _CONTACT, False)
    stop = None if law == NO_LAW else Stop(LAWS[law](seen))
    return System(ImpactOscillator(moving, stop), initial, Start(0.0), Sensor())


def parameters(oscillator: str, laws: Iterable[str]) -> dict[str, Range]:
    """All parameters of motion, contact and start, by name."""
    found: dict[str, Range] = {}
    for law in laws:
        known = handles(typical_system(oscillator, law, _OPTIONAL, True))
        found |= {name: each.allowed for name, each in known.items() if each.path[0] != "sensor"}
    return found
