"""Outcome codes of a fit, each with its message."""

from impactjax._abstract_code import AbstractCode


class Outcome(AbstractCode):
    """Outcome of a fit: convergence, or the cause of failure."""

    CONVERGED = 0, "converged"
    MAX_ITERATIONS = 1, "the search took all its evaluations (`max_iterations`)"
    NO_DESCENT = 2, "no step, however short, lowers the sum of squares"
    NOT_SIMULATED = 3, "nothing could be simulated from any start"
    TOO_FEW_OBSERVATIONS = 4, "there are no more observations than parameters"
    WORSE_THAN_SPECIAL_CASE = 5, "a model that it contains fits better"
    SCATTER_UNSETTLED = 6, "the size of the scatter from impact to impact did not settle"
    SCATTER_BEYOND = (
        7,
        "there are `max_impacts` impacts or more, and later ones cannot scatter; raise "
        "`Simulation(max_impacts=...)`",
    )
