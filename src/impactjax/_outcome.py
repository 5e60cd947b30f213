"""Outcome codes of a fit, each with its message."""

import enum

_WORDS = (
    "converged",
    "the search took all its evaluations (`max_iterations`)",
    "no step, however short, lowers the sum of squares",
    "nothing could be simulated from any start",
    "there are no more observations than parameters",
    "a model that it contains fits better: the search ended in another minimum",
    "the size of the scatter from impact to impact did not settle",
)


class Outcome(enum.IntEnum):
    """Outcome of a fit: convergence, or the cause of failure."""

    CONVERGED = 0
    MAX_ITERATIONS = 1
    NO_DESCENT = 2
    NOT_SIMULATED = 3
    TOO_FEW_OBSERVATIONS = 4
    WORSE_THAN_SPECIAL_CASE = 5
    SCATTER_UNSETTLED = 6

    def __str__(self) -> str:
        return _WORDS[self.value]
