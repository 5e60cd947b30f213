"""One recording and what stands behind it."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from jaxtyping import ArrayLike

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.noise import AbstractNoise, AutoregressiveNoise
from impactjax._problem.problem import Simulation, Tie
from impactjax._record.recording import AnyRecording
from impactjax._sensor.sensor import Sensor

Fixed = Sequence[str] | Mapping[str, ArrayLike]


class Experiment(NamedTuple):
    """One recording and what stands behind it; the terms are those of `fit`.

    - `model`: the system, with starting values.
    - `recording`: what was measured.
    - `initial`: starting values of the state at the first sample or impact.
    - `sensor`: what stands between motion and recording; nothing if `None`.
    - `fixed`: names of parameters to leave alone, or their values by name.
    - `free`: names of parameters to fit although they are usually known.
    - `ties`: parameters that follow from others of this experiment.
    - `simulation`, `loss`, `noise`: how it is simulated, and what is assumed of its residuals.
    """

    model: ImpactOscillator
    recording: AnyRecording
    initial: InitialState
    sensor: Sensor | None = None
    fixed: Fixed = ()
    free: Sequence[str] = ()
    ties: Mapping[str, Tie] = MappingProxyType({})
    simulation: Simulation = Simulation()
    loss: AbstractLoss = Squares()
    noise: AbstractNoise = AutoregressiveNoise()
