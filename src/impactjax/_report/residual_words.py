"""Sentences on the residuals of a fit.

Each sentence follows from one property of `ResidualDiagnostics` and quotes the statistic with its
limit.
"""

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._identify.residual_diagnostics import ResidualDiagnostics, residual_diagnostics
from impactjax._number_format import apart
from impactjax._problem.problem import Problem
from impactjax._report.outcome import was_simulated

_SAME = 0.005  # difference of a factor from 1 that two decimals do not show


def residual_sentences(estimate: Estimate[Problem]) -> list[str]:
    """Sentences on independence, constant variance and normality of the residuals."""
    if not was_simulated(estimate):
        return ["Nothing could be simulated, so there are no residuals."]
    found = residual_diagnostics(estimate)
    return [independence(estimate, found), *_after_impacts(estimate, found), _normality(found)]


def independence(estimate: Estimate[Problem], found: ResidualDiagnostics) -> str:
    """Sentence on the independence of the residuals, and its effect on the errors."""
    if bool(found.independent):
        correlated, runs = _correlations(found), _runs(found)
        return f"The residuals look independent: {' and '.join([*correlated, runs])}."
    against = [
        *([] if bool(found.uncorrelated) else _correlations(found)),
        *([] if bool(found.as_many_runs) else [_runs(found)]),
    ]
    return (
        f"The residuals are not independent: {' and '.join(against)}. The noise is filtered or the "
        f"law is wrong; {_allowance(estimate)}."
    )


def _correlations(found: ResidualDiagnostics) -> list[str]:
    rho = np.asarray(found.autocorrelation)
    if not rho.any():
        return []
    value, limit = apart(float(found.portmanteau), float(found.portmanteau_limit))
    lag = int(np.argmax(np.abs(rho)))
    return [
        f"the Ljung-Box statistic is {value} (limit {limit}; the largest autocorrelation is "
        f"{rho[lag]:.2f}, at lag {lag + 1})"
    ]


def _runs(found: ResidualDiagnostics) -> str:
    low, high = (float(each) for each in np.asarray(found.runs_limits))
    return (
        f"there are {int(found.runs)} runs of one sign (limits {max(int(np.ceil(low)), 1)} to "
        f"{int(np.floor(high))})"
    )


def _allowance(estimate: Estimate[Problem]) -> str:
    """Clause on the factors by which the errors differ from those for independent residuals."""
    inflation = np.asarray(estimate.inflation)
    factors = inflation[np.isfinite(inflation)]
    if not factors.size or np.all(np.abs(factors - 1) < _SAME):
        return "the errors assume independent residuals"
    low, high = factors.min(), factors.max()
    return f"the errors account for this, by factors from {low:.2f} to {high:.2f}"


def _normality(found: ResidualDiagnostics) -> str:
    skewness, kurtosis = float(found.skewness), float(found.excess_kurtosis)
    numbers = f"skewness {skewness:.2f}, excess kurtosis {kurtosis:.2f}"
    if bool(found.normal):
        return f"Their distribution is consistent with a normal one ({numbers})."
    shape = []
    if bool(found.skewed):
        shape.append("skewed")
    if bool(found.tailed):
        shape.append(f"with {'longer' if kurtosis > 0 else 'shorter'} tails than a normal one")
    said = f": it is {' and '.join(shape)}" if shape else ""
    return f"Their distribution is not normal{said} ({numbers})."


def _after_impacts(estimate: Estimate[Problem], found: ResidualDiagnostics) -> list[str]:
    if estimate.problem.recording.observes_impacts:
        return []
    after = np.asarray(found.after_impacts)
    large = np.flatnonzero(np.asarray(found.larger_after_impacts))
    if not large.size:
        return []
    numbers = ", ".join(str(i + 1) for i in large)
    which = f"impact {numbers}" if large.size == 1 else f"impacts {numbers}"
    return [
        f"Just after {which} they are up to {after[large].max():.2f} times as large as overall: "
        "the law does not fully describe the contact."
    ]
