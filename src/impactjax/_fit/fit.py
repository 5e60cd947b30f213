"""The verb `fit`: model and recording → estimate."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import jax
import numpy as np
from jax.core import Tracer

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.evaluation import Lanes
from impactjax._fit.search import Search, Searches, lowest
from impactjax._fit.starts import Starts
from impactjax._fit.uncertainty import summarise
from impactjax._known import AnyArray, is_known, namespace
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.checks import check_declared, check_observable, check_requests
from impactjax._problem.experiment import Experiment, Fixed
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.noise import AbstractNoise, AutoregressiveNoise
from impactjax._problem.parameters import Start, System, handles, replaced
from impactjax._problem.problem import Problem, Simulation, Tie
from impactjax._record.recording import AnyRecording, ImpactTimes
from impactjax._sensor.sensor import Sensor


def fit(
    model: ImpactOscillator,
    recording: AnyRecording,
    *,
    initial: InitialState,
    sensor: Sensor | None = None,
    fixed: Fixed = (),
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
    - `fixed`: names of parameters to leave alone, or their values by name:
      `{"zeta": 0.0017}`.
    - `free`: names of parameters to fit although they are usually known.
    - `starts`: from where to search.
    - `optimiser`, `simulation`: how.
    - `loss`: how much a residual counts: `Squares()`, or `SoftL1`, `Cauchy`, `StudentT` where some
      samples are far off.
    - `noise`: what the errors assume of the residuals.
    - `ties`: parameters that follow from the others, each a function of all parameters by name:
      `{"upper_r": lambda at: at["lower_r"]}`.

    **Raises** `ValueError` for a name that the system does not have, a value that is out of range,
    a number in the model that is not declared as a `parameter`, and for a recording with fewer
    observations than parameters. A fit that does not converge says so in the estimate.
    """
    experiment = Experiment(
        model, recording, initial, sensor, fixed, free, ties, simulation, loss, noise
    )
    problem = pose(experiment)
    check_declared(problem.system)
    return solve(problem, starts, optimiser)


def solve(
    problem: Problem, starts: Starts, optimiser: LevenbergMarquardt, search: Search = Search()
) -> Estimate[Problem]:
    """The estimate of the best of several searches."""
    return best_from(problem, starts.lanes(problem), optimiser, search)


def best_from(
    problem: P,
    lanes: Lanes,
    optimiser: LevenbergMarquardt,
    search: Search = Search(),
    beside: Lanes | None = None,
) -> Estimate[P]:
    """The estimate of the best of searches from some starts in the optimiser's coordinates, and
    from as many others that are close already: in these each part is the whole record, so that none
    ends above where it started.
    """
    own, problem = problem, problem.padded() if is_known(problem) else problem
    everything = np.ones(lanes.shape, bool)
    parts = problem.parts(optimiser.horizons)
    minima = search.minima(problem, optimiser, Searches(lanes, everything, parts))
    if beside is not None:
        whole = namespace(parts).broadcast_to(parts[-1], parts.shape)
        more = lowest(search.minima(problem, optimiser, Searches(beside, everything, whole)))
        minima = jax.tree.map(_with_last, minima, more)
    best = search.best_of(problem, minima, parts)
    return summarise(problem, best, minima.cost).of(own)


def _with_last(x: AnyArray, last: AnyArray) -> AnyArray:
    return namespace(x).concatenate([x[:-1], last[None]])


def pose(experiment: Experiment) -> Problem:
    """The problem that an experiment sets. Raises as `fit` does."""
    recording, fixed, ties = experiment.recording, experiment.fixed, experiment.ties
    first = recording.times[0] if isinstance(recording, ImpactTimes) else recording.ts[0]
    unit = "s" if isinstance(recording, ImpactTimes) else recording.quantity.unit
    sensor = Sensor() if experiment.sensor is None else experiment.sensor
    system = System(experiment.model, experiment.initial, Start(first), sensor, unit)
    known = handles(system)
    check_observable(experiment)
    check_requests(experiment, system)
    if isinstance(fixed, Mapping):
        system = replaced(system, tuple(fixed), tuple(fixed.values()))
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
