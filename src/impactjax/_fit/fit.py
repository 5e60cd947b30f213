"""The verb `fit`: model and recording → estimate."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.experiment import Experiment
from impactjax._fit.levenberg_marquardt import LevenbergMarquardt
from impactjax._fit.loss import AbstractLoss, Squares
from impactjax._fit.noise import AbstractNoise, AutoregressiveNoise
from impactjax._fit.problem import Problem, Simulation, Tie
from impactjax._fit.search import Lanes, Search, best_of, search
from impactjax._fit.starts import Starts
from impactjax._fit.summary import summarise
from impactjax._fit.system import Start, System, handles
from impactjax._measure.quantity import ContactForce
from impactjax._measure.recording import AnyRecording, ImpactTimes
from impactjax._measure.sensor import Sensor
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._simulate.simulate import InitialState


def fit(
    model: ImpactOscillator,
    recording: AnyRecording,
    *,
    initial: InitialState,
    sensor: Sensor | None = None,
    fixed: Sequence[str] = (),
    free: Sequence[str] = (),
    starts: Starts = Starts(1),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
    simulation: Simulation = Simulation(),
    loss: AbstractLoss = Squares(),
    noise: AbstractNoise = AutoregressiveNoise(),
    ties: Mapping[str, Tie] = MappingProxyType({}),
) -> Estimate[Problem]:
    """Least squares between a simulated and a recorded motion, on exact Jacobians.

    The parameters' values in `model`, `initial` and `sensor` are where the search starts. What is
    usually measured otherwise (masses, lengths, gravity, gaps, the sensor) is left alone unless it
    is asked for by `free`. Works under `jit` and `vmap`, over models and over recordings.

    **Arguments:**

    - `model`: the system, with starting values.
    - `recording`: what was measured.
    - `initial`: starting values of the state at the first sample or impact.
    - `sensor`: what stands between motion and recording; nothing if left out.
    - `fixed`: names of parameters to leave alone.
    - `free`: names of parameters to fit although they are usually known.
    - `starts`: from where to search.
    - `optimiser`, `simulation`: how.
    - `loss`: how much a residual counts: `Squares()`, or `SoftL1`, `Cauchy`, `StudentT` where some
      samples are far off.
    - `noise`: what the errors assume of the residuals.
    - `ties`: parameters that follow from the others, each a function of all parameters by name:
      `{"upper_r": lambda at: at["lower_r"]}`.

    **Raises** `ValueError` for a name that the system does not have, and for a recording with fewer
    observations than parameters. A fit that does not converge says so in the estimate.
    """
    experiment = Experiment(
        model, recording, initial, sensor, fixed, free, ties, simulation, loss, noise
    )
    return solve(pose(experiment), starts, optimiser)


def solve(
    problem: Problem, starts: Starts, optimiser: LevenbergMarquardt, search: Search = search
) -> Estimate[Problem]:
    """The estimate of the best of several searches."""
    return best_from(problem, starts.lanes(problem), optimiser, search)


def best_from(
    problem: P, lanes: Lanes, optimiser: LevenbergMarquardt, search: Search = search
) -> Estimate[P]:
    """The estimate of the best of searches from some starts in the optimiser's coordinates."""
    everything = jnp.asarray(np.ones(lanes.shape, bool))
    minima = search(problem, optimiser, lanes, everything, problem.parts(optimiser.horizons))
    return summarise(problem, best_of(minima), minima.quadratic.cost)


def pose(experiment: Experiment) -> Problem:
    """The problem that an experiment sets. Raises as `fit` does."""
    recording, fixed, ties = experiment.recording, experiment.fixed, experiment.ties
    first = recording.times[0] if isinstance(recording, ImpactTimes) else recording.ts[0]
    unit = "s" if isinstance(recording, ImpactTimes) else recording.quantity.unit
    sensor = Sensor() if experiment.sensor is None else experiment.sensor
    system = System(experiment.model, experiment.initial, Start(first), sensor, unit)
    known = handles(system)
    _check_observable(experiment)
    _check_requests(experiment, system)
    usual = {name for name, handle in known.items() if not handle.allowed.known}
    if isinstance(recording, ImpactTimes):
        usual = (usual | {"t0"}) - {"x0", "theta0"}
    wanted = (usual | {*experiment.free}) - {*fixed, *ties}
    names = tuple(name for name in known if name in wanted)
    traced = isinstance(recording.valid, Tracer)
    count = recording.valid.shape[0] if traced else int(np.asarray(recording.valid).sum())
    if count <= len(names):
        raise ValueError(
            f"The recording has {count} observations, too few for {len(names)} parameters "
            f"({', '.join(names)}); fix some of them."
        )
    return Problem(
        system=system,
        recording=recording,
        names=names,
        simulation=experiment.simulation,
        loss=experiment.loss,
        noise=experiment.noise,
        ties=tuple(ties.items()),
    )


def _check_observable(experiment: Experiment) -> None:
    """That the oscillator and its stops have what was recorded."""
    if isinstance(experiment.recording, ImpactTimes):
        return
    quantity, model = experiment.recording.quantity, experiment.model
    if quantity.of_angle not in (None, model.oscillator.is_angle()):
        raise ValueError(
            f"A record of {quantity.name} does not suit a {type(model.oscillator).__name__}."
        )
    laws = [stop.law for stop in (model.lower, model.upper) if stop is not None]
    if isinstance(quantity, ContactForce) and not any(
        isinstance(law, AbstractForceLaw) for law in laws
    ):
        raise ValueError("No stop of the model has a force law, so there is no contact force.")


def _check_requests(experiment: Experiment, system: System) -> None:
    """That all names are known, each asked for once, and that ties can be worked out."""
    known = handles(system)
    asked = {"fixed": experiment.fixed, "free": experiment.free, "ties": tuple(experiment.ties)}
    seen: dict[str, str] = {}
    for argument, names in asked.items():
        if isinstance(names, str):
            raise ValueError(f"Argument `{argument}` must be a list of names: ['{names}'].")
        for name in names:
            if name not in known:
                raise ValueError(f"There is no parameter `{name}`; there are {', '.join(known)}.")
            if seen.setdefault(name, argument) != argument:
                raise ValueError(f"`{name}` is in both `{seen[name]}` and `{argument}`.")
    at = {name: handle.get(system) for name, handle in known.items() if name not in experiment.ties}
    for name, tie in experiment.ties.items():
        try:
            value = jnp.asarray(tie(at))
        except KeyError as error:
            raise ValueError(
                f"The tie of `{name}` asks for {error}, which is no parameter or tied itself."
            ) from error
        if value.shape != known[name].get(system).shape:
            raise ValueError(f"The tie of `{name}` gives shape {value.shape}, not one number.")
