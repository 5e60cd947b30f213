"""Reasons of verdicts."""

from typing import TYPE_CHECKING

from jaxtyping import Int

from impactjax._abstract_code import AbstractCode
from impactjax._fit.verdict import Verdict
from impactjax._known import AnyArray, namespace

if TYPE_CHECKING:
    from impactjax._fit.estimate import Estimate, P


class Reason(AbstractCode):
    """Reason of the verdict on a parameter."""

    FIXED = 0, "it was not fitted"
    BOUNDED = 1, "both ends of its interval were found"
    OPEN_ABOVE = 2, "its interval is open above"
    OPEN_BELOW = 3, "its interval is open below"
    OPEN = 4, "its interval is open on both sides"
    NO_TRACE = 5, "the record does not depend on it"
    NOT_CONVERGED = 6, "the search did not converge"
    MISSES_RECORD = 7, "the model misses the record"
    LASTING_CORRELATION = (
        8,
        "the residuals are autocorrelated over longer times than the noise model covers",
    )
    PROFILE_STOPPED = 9, "the search for an end of its interval failed"
    EXCEEDS_NOISE = 10, "the residuals at impacts, or all of them, are larger than the noise"


def reasons(estimate: "Estimate[P]") -> Int[AnyArray, "... parameters"]:
    """The `Reason` number of each verdict of an estimate, or of many under `vmap`."""
    xp = namespace(estimate.values)
    ranges = [handle.allowed for handle in estimate.problem.handles().values()]
    below = estimate.low > xp.asarray([allowed.low for allowed in ranges])
    sides = xp.where(below, Reason.OPEN_ABOVE, Reason.OPEN_BELOW)
    unknown = xp.isnan(estimate.low) | xp.isnan(estimate.high)
    undecided = estimate.verdicts == Verdict.UNDECIDED
    cases = (
        (~estimate.converged[..., None], Reason.NOT_CONVERGED),
        (estimate.misfit[..., None] > 0, Reason.MISSES_RECORD),
        (~xp.isfinite(estimate.standard_errors), Reason.NO_TRACE),
        (unknown, Reason.PROFILE_STOPPED),
        (undecided & estimate.exceeds_noise[..., None], Reason.EXCEEDS_NOISE),
        (undecided, Reason.LASTING_CORRELATION),
        (estimate.verdicts == Verdict.IDENTIFIED, Reason.BOUNDED),
        (estimate.verdicts == Verdict.ONE_SIDED, sides),
    )
    found = xp.full(estimate.verdicts.shape, int(Reason.OPEN))
    for holds, reason in reversed(cases):
        found = xp.where(holds, reason, found)
    return found.astype(estimate.verdicts.dtype)
