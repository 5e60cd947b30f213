"""The experiment: one recording with its model and all that is known about it."""

from collections.abc import Mapping, Sequence

import equinox as eqx
from jaxtyping import Array, ArrayLike, Float

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState, check_angle
from impactjax._parameter import as_parameter
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.noise import AbstractNoise, AutoregressiveNoise
from impactjax._problem.prior import Normal
from impactjax._problem.problem import Tie
from impactjax._problem.scatter import AbstractScatter
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._refusal import as_names, check_kind, of_kind
from impactjax._sensor.sensor import Sensor
from impactjax._shown import with_numbers
from impactjax._simulate.simulation import Simulation

Fixed = Sequence[str] | Mapping[str, ArrayLike | None]
_MODEL = "ImpactOscillator(Pendulum(13.0), Stop(Restitution(0.7)))"


class Experiment(eqx.Module):
    """One recording with its model and all that is known about it: the argument of every verb.

    A search starts from the parameter values in `model`, `initial` and `sensor`. Parameters that
    are usually measured separately (masses, lengths, gravity, gaps, the sensor) are fitted only if
    they are listed in `free`.

    **Arguments:**

    - `model`: oscillator with its stops.
    - `recording`: measured data.
    - `initial`: state at the first sample or impact.
    - `sensor`: gain, offset, filter and noise of the instrument; `None` for an ideal one.
    - `fixed`: names of parameters not to fit, or their values by name: `{"zeta": 0.0017}`; a value
      `None` keeps that of the model.
    - `free`: names of parameters to fit although they are usually known.
    - `ties`: parameters that follow from the others, each a function of all parameters by name:
      `{"upper_r": lambda at: at["lower_r"]}`.
    - `priors`: prior knowledge of parameters, by name, `{"mass": Normal(0.02, 1e-4)}`. Those that
      are usually measured separately are then fitted.
    - `bounds`: limits of fitted parameters, narrower than their own range, by name:
      `{"gamma": (0.1, 0.3)}`.
    - `loss`: cost of a residual: `Squares()`, or `SoftL1`, `Cauchy`, `StudentT` against outliers.
    - `scatter`: distribution of the speed after each impact around that of the law:
      `NormalScatter()` or `NoScatter()`. By default impact times with at least four flights have
      `NormalScatter()`, everything else `NoScatter()`. `compare` and `with_left_out` fit scatter to
      a motion that asks for it, and from four impacts on intervals of `compare` allow for it.
    - `noise`: model of the residuals' correlation, from which the errors follow.
    - `simulation`: settings of the simulation.

    **Raises** `TypeError` for an argument of another type, and `ValueError` for an angle that looks
    like degrees.
    """

    model: ImpactOscillator = eqx.field(converter=of_kind("model", ImpactOscillator, _MODEL))
    recording: AbstractRecording = eqx.field(
        converter=of_kind("recording", AbstractRecording, "Recording(ts, values, Angle())")
    )
    initial: InitialState = eqx.field(
        converter=of_kind("initial", InitialState, "InitialState(0.78)")
    )
    sensor: Sensor = eqx.field(converter=lambda given: _as_sensor(given), default=None)
    fixed: dict[str, Float[Array, "..."] | None] = eqx.field(
        converter=lambda given: _as_fixed(given), default_factory=dict
    )
    free: tuple[str, ...] = eqx.field(
        converter=lambda given: as_names("free", given), default=(), static=True
    )
    ties: tuple[tuple[str, Tie], ...] = eqx.field(
        converter=lambda given: _as_ties(given), default=(), static=True
    )
    priors: dict[str, Normal] = eqx.field(
        converter=lambda given: _as_priors(given), default_factory=dict
    )
    bounds: tuple[tuple[str, tuple[float, float]], ...] = eqx.field(
        converter=lambda given: _as_bounds(given), default=(), static=True
    )
    loss: AbstractLoss = eqx.field(
        converter=of_kind("loss", AbstractLoss, "Cauchy(0.01)"), default=Squares()
    )
    noise: AbstractNoise = eqx.field(
        converter=of_kind("noise", AbstractNoise, "WhiteNoise()"), default=AutoregressiveNoise()
    )
    scatter: AbstractScatter | None = eqx.field(
        converter=of_kind("scatter", AbstractScatter, "NormalScatter()", optional=True),
        default=None,
    )
    simulation: Simulation = eqx.field(
        converter=of_kind("simulation", Simulation, "Simulation(max_impacts=128)"),
        default=Simulation(),
    )

    def __check_init__(self) -> None:
        check_angle(self.model.oscillator, self.initial)

    __repr__ = with_numbers


def _as_sensor(given: Sensor | None) -> Sensor:
    if given is None:
        return Sensor()
    check_kind("sensor", given, Sensor, "Sensor(low_pass=Butterworth(50.0))")
    return given


def _as_fixed(given: Fixed) -> dict[str, Float[Array, "..."] | None]:
    if not isinstance(given, Mapping):
        return dict.fromkeys(as_names("fixed", given))
    return {name: None if v is None else as_parameter(v) for name, v in given.items()}


def _as_ties(given: Mapping[str, Tie] | tuple[tuple[str, Tie], ...]) -> tuple[tuple[str, Tie], ...]:
    return tuple(dict(given).items())


def _as_bounds(
    given: Mapping[str, tuple[float, float]] | tuple[tuple[str, tuple[float, float]], ...],
) -> tuple[tuple[str, tuple[float, float]], ...]:
    found = {name: (float(low), float(high)) for name, (low, high) in dict(given).items()}
    for name, (low, high) in found.items():
        if not low < high:
            raise ValueError(
                f"The bounds of `{name}` must rise, but they are {low:g} and {high:g}."
            )
    return tuple(found.items())


def _as_priors(given: Mapping[str, Normal]) -> dict[str, Normal]:
    for prior in given.values():
        check_kind("priors", prior, Normal, "Normal(0.071, 0.001)")
    return dict(given)
