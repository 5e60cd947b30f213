"""The system of an experiment: model, initial state, start time and sensor."""

import equinox as eqx

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._parameter import as_parameter, parameter
from impactjax._sensor.sensor import Sensor
from impactjax._shown import with_numbers
from impactjax._types import Factors, Time


class Start(eqx.Module):
    """Start of a simulation.

    - `t0`: time of the initial state [s].
    """

    t0: Time = eqx.field(converter=as_parameter, metadata=parameter("s", known=True))


class System(eqx.Module):
    """All parts of an experiment that have parameters.

    - `model`, `initial`, `start`, `sensor`: the parts.
    - `unit`: SI unit of the recorded quantity.
    - `factors`: factor on the speed after each impact, as for `simulate`; `None` for no scatter.
    """

    model: ImpactOscillator
    initial: InitialState
    start: Start
    sensor: Sensor
    unit: str = eqx.field(static=True, default="")
    factors: Factors | None = None

    __repr__ = with_numbers
