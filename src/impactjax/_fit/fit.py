"""The verb `fit`: model and recording → estimate."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from impactjax._fit.estimate import Estimate
from impactjax._fit.levenberg_marquardt import LevenbergMarquardt, Minimum, minimise
from impactjax._fit.problem import Answer, Problem, Simulation
from impactjax._fit.starts import Starts
from impactjax._fit.summary import summarise
from impactjax._fit.system import Start, System, handles
from impactjax._measure.recording import AnyRecording, ImpactTimes
from impactjax._measure.sensor import Sensor
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.simulate import InitialState

Lanes = Float[Array, "lanes parameters"]


def fit(
    model: ImpactOscillator,
    recording: AnyRecording,
    *,
    initial: InitialState,
    sensor: Sensor = Sensor(),
    fixed: Sequence[str] = (),
    free: Sequence[str] = (),
    starts: Starts = Starts(1),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
    simulation: Simulation = Simulation(),
) -> Estimate:
    """Least squares between a simulated and a recorded motion, on exact Jacobians.

    The parameters' values in `model`, `initial` and `sensor` are where the search starts. What is
    usually measured otherwise (masses, lengths, gravity, gaps, the sensor) is left alone unless it
    is asked for by `free`. Works under `jit` and `vmap`, over models and over recordings.

    **Arguments:**

    - `model`: the system, with starting values.
    - `recording`: what was measured.
    - `initial`: starting values of the state at the first sample or impact.
    - `sensor`: what stands between motion and recording.
    - `fixed`: names of parameters to leave alone.
    - `free`: names of parameters to fit although they are usually known.
    - `starts`: from where to search.
    - `optimiser`, `simulation`: how.

    **Raises** `ValueError` for a name that the system does not have, and for a recording with fewer
    observations than parameters. A fit that does not converge says so in the estimate.
    """
    problem = _problem(model, recording, initial, sensor, fixed, free, simulation)
    lanes = starts.lanes(problem)
    active = jnp.ones(lanes.shape, bool)
    return summarise(problem, best_of(search(problem, optimiser, lanes, active)))


def _problem(
    model: ImpactOscillator,
    recording: AnyRecording,
    initial: InitialState,
    sensor: Sensor,
    fixed: Sequence[str],
    free: Sequence[str],
    simulation: Simulation,
) -> Problem:
    by_times = isinstance(recording, ImpactTimes)
    first = recording.times[0] if isinstance(recording, ImpactTimes) else recording.ts[0]
    system = System(model, initial, Start(first), sensor)
    known = handles(system)
    for name in (*fixed, *free):
        if name not in known:
            raise ValueError(f"There is no parameter `{name}`; there are {', '.join(known)}.")
    usual = {name for name, handle in known.items() if not handle.allowed.known}
    if by_times:
        usual = (usual | {"t0"}) - {"x0", "theta0"}
    names = tuple(name for name in known if name in (usual | set(free)) - set(fixed))
    count = recording.times.shape[0] if by_times else recording.ts.shape[0]
    if count <= len(names):
        raise ValueError(
            f"The recording has {count} observations, too few for {len(names)} parameters "
            f"({', '.join(names)}); fix some of them."
        )
    return Problem(system, recording, names, simulation)


@eqx.filter_jit
def search(
    problem: Problem,
    optimiser: LevenbergMarquardt,
    lanes: Lanes,
    active: Bool[Array, "lanes parameters"],
) -> Minimum[Answer]:
    """A minimum from each start; starts are in the optimiser's coordinates."""
    return jax.vmap(lambda u, on: minimise(optimiser, problem.expand, u, on))(lanes, active)


@eqx.filter_jit
def best_of(minima: Minimum[Answer]) -> Minimum[Answer]:
    """The lowest of several minima."""
    cost = minima.quadratic.cost
    best = jnp.argmin(jnp.where(jnp.isfinite(cost), cost, jnp.inf))
    return jax.tree.map(lambda x: x[best], minima)
