"""How a fit ended, in words."""

import jax.numpy as jnp
import numpy as np

from impactjax._compare.compare import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._record.recording import ImpactTimes
from impactjax._results import RESULTS
from impactjax._simulate.simulate import simulate


def outcome(estimate: Estimate) -> str:
    """`converged`, or why there is no result to be used."""
    if bool(estimate.converged) and float(estimate.misfit) > 0:
        return f"misses the record: {100 * float(estimate.misfit):.0f} % of its motion is left"
    if bool(estimate.converged):
        return "converged"
    if was_simulated(estimate):
        return f"not converged after {int(estimate.iterations)} evaluations"
    reason, *_ = str(RESULTS[_result(estimate)]).split(". ")
    return f"not simulated: {reason.removesuffix('.')}"


def outcome_of(fitted: Fitted) -> str:
    """The outcome of a law among others."""
    if fitted.worse_than:
        return f"worse than {', '.join(fitted.worse_than)}, which it contains: the search failed"
    return outcome(fitted.estimate)


def was_simulated(estimate: Estimate) -> bool:
    """Whether the law could be simulated from any start."""
    return bool(np.isfinite(np.asarray(estimate.start_costs)).any())


def _result(estimate: Estimate) -> RESULTS:
    """What becomes of a simulation at the values where the search ended."""
    problem, system = estimate.problem, estimate.system
    recording = problem.recording
    ts = recording.times[-1:] if isinstance(recording, ImpactTimes) else recording.ts
    return simulate(
        system.model,
        system.initial,
        jnp.asarray(ts) - system.sensor.delay,
        t0=system.start.t0 - system.sensor.delay,
        tolerance=problem.simulation.tolerance,
        max_steps=problem.simulation.max_steps,
        max_impacts=problem.simulation.max_impacts,
        step=problem.simulation.step,
    ).result
