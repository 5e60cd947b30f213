"""Reason of a failed simulation, in words."""

from impactjax._problem.abstract_problem import AbstractProblem
from impactjax._results import RESULTS


def failure(problem: AbstractProblem) -> str:
    """The reason why a simulation from the starting values fails."""
    for each, _ in problem.each_recording():
        result = each.recording.result(each.system, each.simulation)
        if result != RESULTS.successful:
            return str(RESULTS[result]).split(". ")[0].removesuffix(".")
    if any(each.recording.observes_impacts for each, _ in problem.each_recording()):
        return "fewer impacts than recorded happen in twice the recorded time"
    return "the residuals are not finite"
