"""Reasons of verdicts."""

import enum
from typing import TYPE_CHECKING

from jaxtyping import Int

from impactjax._fit.verdict import Verdict
from impactjax._known import AnyArray, namespace

if TYPE_CHECKING:
    from impactjax._fit.estimate import Estimate, P

_WORDS = (
    "it was not fitted",
    "both ends of its interval were found",
    "its interval is open above",
    "its interval is open below",
    "its interval is open on both sides",
    "the record does not depend on it",
    "the search did not converge",
    "the model misses the record",
    "the residuals are autocorrelated over longer times than the noise model covers",
    "the search for an end of its interval failed",
)


class Reason(enum.IntEnum):
    """Reason of the verdict on a parameter."""

    FIXED = 0
    BOUNDED = 1
    OPEN_ABOVE = 2
    OPEN_BELOW = 3
    OPEN = 4
    NO_TRACE = 5
    NOT_CONVERGED = 6
    MISSES_RECORD = 7
    LASTING_CORRELATION = 8
    PROFILE_STOPPED = 9

    def __str__(self) -> str:
        return _WORDS[self.value]


def reasons(estimate: "Estimate[P]") -> Int[AnyArray, "... parameters"]:
    """The `Reason` number of each verdict of an estimate, or of many under `vmap`."""
    xp = namespace(estimate.values)
    ranges = [handle.allowed for handle in estimate.problem.handles().values()]
    below = estimate.low > xp.asarray([allowed.low for allowed in ranges])
    sides = xp.where(below, Reason.OPEN_ABOVE, Reason.OPEN_BELOW)
    unknown = xp.isnan(estimate.low) | xp.isnan(estimate.high)
    cases = (
        (~estimate.converged[..., None], Reason.NOT_CONVERGED),
        (estimate.misfit[..., None] > 0, Reason.MISSES_RECORD),
        (~xp.isfinite(estimate.standard_errors), Reason.NO_TRACE),
        (unknown, Reason.PROFILE_STOPPED),
        (estimate.verdicts == Verdict.UNDECIDED, Reason.LASTING_CORRELATION),
        (estimate.verdicts == Verdict.IDENTIFIED, Reason.BOUNDED),
        (estimate.verdicts == Verdict.ONE_SIDED, sides),
    )
    found = xp.full(estimate.verdicts.shape, int(Reason.OPEN))
    for holds, reason in reversed(cases):
        found = xp.where(holds, reason, found)
    return found.astype(estimate.verdicts.dtype)
