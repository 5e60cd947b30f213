"""Outcome of a fit in words."""

from impactjax._compare.comparison import Fitted
from impactjax._fit.estimate import Estimate
from impactjax._outcome import Outcome
from impactjax._problem.problem import Problem


def outcome_of(fitted: Fitted) -> str:
    """The outcome of a law in a comparison, in words."""
    if int(fitted.estimate.outcome) == Outcome.WORSE_THAN_SPECIAL_CASE:
        return f"worse than {', '.join(fitted.worse_than)}, which it contains: the search failed"
    return fitted.estimate.cause


def was_simulated(estimate: Estimate[Problem]) -> bool:
    """True if the simulation succeeded from at least one start."""
    return int(estimate.outcome) != Outcome.NOT_SIMULATED
