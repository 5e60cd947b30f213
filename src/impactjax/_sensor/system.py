"""An oscillator between its stops, where its motion starts, and the sensor that watches it."""

import equinox as eqx

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._parameter import as_parameter, parameter
from impactjax._sensor.sensor import Sensor
from impactjax._shown import with_numbers
from impactjax._types import Time


class Start(eqx.Module):
    """Time at which a run starts.

    - `t0`: time of the initial state [s].
    """

    t0: Time = eqx.field(converter=as_parameter, metadata=parameter("s", known=True))


class System(eqx.Module):
    """All that has parameters in an experiment.

    - `model`, `initial`, `start`, `sensor`: its parts.
    - `unit`: of what is recorded.
    """

    model: ImpactOscillator
    initial: InitialState
    start: Start
    sensor: Sensor
    unit: str = eqx.field(static=True, default="")

    __repr__ = with_numbers
