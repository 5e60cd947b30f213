"""Outcome of a fit in words."""

import numpy as np

from impactjax._compare.comparison import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._problem.problem import Problem


def outcome_of(fitted: Fitted) -> str:
    """The outcome of a law in a comparison, in words."""
    if fitted.worse_than:
        return f"worse than {', '.join(fitted.worse_than)}, which it contains: the search failed"
    return fitted.estimate.cause


def was_simulated(estimate: Estimate[Problem]) -> bool:
    """True if the simulation succeeded from at least one start."""
    return bool(np.isfinite(np.asarray(estimate.start_costs)).any())
