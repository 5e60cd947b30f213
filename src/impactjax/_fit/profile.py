"""Profile likelihood: intervals from refits with one parameter held.

Source: D. J. Venzon and S. H. Moolgavkar (1988), "A method for computing
profile-likelihood-based confidence intervals", Applied Statistics 37, 87; A. Raue et al. (2009),
"Structural and practical identifiability analysis", Bioinformatics 25, 1923.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy import special

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.profile_walk import Walk
from impactjax._fit.refits import refits_of
from impactjax._fit.search import Search, usual_search
from impactjax._fit.straight import straight
from impactjax._fit.verdict import Verdict
from impactjax._fit.walks import begun, local, walked
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt

_DIFFERENT = 1.5  # ratio of two errors above which the standard error is replaced


def profiled(
    estimate: Estimate[P], optimiser: LevenbergMarquardt = LevenbergMarquardt()
) -> Estimate[P]:
    """The estimate with intervals and verdicts from the profile likelihood.

    Each parameter is held at values on both sides of its estimate while the others are fitted
    again. The interval ends where √((S − S_min)/σ²), with the sum of squares S of the refit,
    reaches the 97.5 % quantile of Student's t, times `inflation` for correlated residuals. A side
    on which it never does is open.

    If the search for an end cannot continue, because the simulation fails there, a lower minimum
    appears or the limit is not found, the end is NaN and the verdict `UNDECIDED`; it is also that
    of a bounded parameter of an estimate that is `doubtful`. A standard error that
    differs from the interval by a factor of 1.5 or more is replaced by that of the interval. An
    estimate that is not `usable`, or has scatter from impact to impact, is returned unchanged: the
    intervals of the latter are integrals over the size of the scatter.

    **Arguments:**

    - `estimate`: estimate of a single fit.
    - `optimiser`: settings of the refits.

    Source: Venzon and Moolgavkar, Applied Statistics 37, 87 (1988).
    """
    return profiled_by(usual_search(estimate.problem), estimate, optimiser)


def profiled_by(
    search: Search, estimate: Estimate[P], optimiser: LevenbergMarquardt = LevenbergMarquardt()
) -> Estimate[P]:
    """Variant of `profiled` with a given search."""
    estimate.check_single()
    if not bool(estimate.usable) or estimate.scatter is not None:
        return estimate
    around, ranges = local(estimate), straight(estimate.problem).ranges
    limit, sides = limit_of(estimate), [(j, side) for j in range(len(ranges)) for side in (-1, 1)]
    walks = [begun(estimate, around, *each, limit) for each in sides]
    walked(estimate, refits_of(estimate, optimiser, search), around, walks)
    below, above = walks[::2], walks[1::2]
    low = np.array([walk.end(each.low) for walk, each in zip(below, ranges, strict=True)])
    high = np.array([walk.end(each.high) for walk, each in zip(above, ranges, strict=True)])
    low, high = around.coordinates.interval(low, high)
    both = [a.bounded and b.bounded for a, b in zip(below, above, strict=True)]
    widths = np.subtract(high, low, where=both, out=np.zeros_like(high))
    errors, covariance = _agreeing(estimate, widths)
    doubtful = bool(estimate.doubtful)
    found = [_verdict(a, b, doubtful) for a, b in zip(below, above, strict=True)]
    verdicts = np.array(found, np.int32)
    return eqx.tree_at(
        lambda each: (each.low, each.high, each.verdicts, each.standard_errors, each.covariance),
        estimate,
        tuple(jnp.asarray(x) for x in (low, high, verdicts, errors, covariance)),
    )


def limit_of(estimate: Estimate[P]) -> float:
    """The 97.5 % quantile of Student's t with the estimate's degrees of freedom."""
    return float(special.stdtrit(float(estimate.freedom), 0.975))


def _agreeing(estimate: Estimate[P], widths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard errors and covariance, scaled to agree with the widths of the intervals; a width of
    zero stands for an unknown one.

    Both agree without scaling for small errors. They do not if another parameter is at the end of
    its range, which linearised errors ignore: correlated parameters then get too large errors.
    """
    errors, covariance = np.asarray(estimate.standard_errors), np.asarray(estimate.covariance)
    half = widths / 2 / limit_of(estimate)
    usual = np.isfinite(errors) & (errors > 0)
    ratios = np.where(usual & (half > 0), half / np.where(usual, errors, 1.0), 1.0)
    ratios = np.where(np.abs(np.log(ratios)) > np.log(_DIFFERENT), ratios, 1.0)
    finite = np.where(np.isfinite(covariance), covariance * np.outer(ratios, ratios), covariance)
    return errors * ratios, finite


def _verdict(below: Walk, above: Walk, doubtful: bool) -> Verdict:
    both = below.bounded and above.bounded
    if below.failed or above.failed or (both and doubtful):
        return Verdict.UNDECIDED
    kinds = (Verdict.NOT_IDENTIFIED, Verdict.ONE_SIDED, Verdict.IDENTIFIED)
    return kinds[below.bounded + above.bounded]
