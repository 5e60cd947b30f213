"""Outcome of a fit in words."""

import numpy as np

from impactjax._compare.comparison import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._results import RESULTS


def outcome(estimate: Estimate) -> str:
    """The outcome of a fit in words: "converged", or the reason why it has no usable result."""
    if bool(estimate.converged) and float(estimate.misfit) > 0:
        return f"misses the record: {100 * float(estimate.misfit):.0f} % of its motion is left"
    if bool(estimate.converged):
        return "converged"
    if was_simulated(estimate):
        return f"not converged after {int(estimate.iterations)} evaluations"
    problem = estimate.problem
    result = problem.recording.result(estimate.system, problem.simulation)
    reason, *_ = str(RESULTS[result]).split(". ")
    return f"not simulated: {reason.removesuffix('.')}"


def outcome_of(fitted: Fitted) -> str:
    """The outcome of a law in a comparison, in words."""
    if fitted.worse_than:
        return f"worse than {', '.join(fitted.worse_than)}, which it contains: the search failed"
    return outcome(fitted.estimate)


def was_simulated(estimate: Estimate) -> bool:
    """True if the simulation succeeded from at least one start."""
    return bool(np.isfinite(np.asarray(estimate.start_costs)).any())
