"""Ranking of laws by Akaike's criterion for correlated residuals and few observations."""

from collections.abc import Sequence

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._problem.problem import Problem

CLEAR = 10.0  # difference of the criterion at which the worse law is rejected


def differences(estimates: Sequence[Estimate[Problem]]) -> list[float]:
    """ΔQAICc: the criterion of each fit minus the lowest one; at least zero.

    QAICc = (n/N) (−2 log L) + 2 k + 2 m (m + 1)/(n − m − 1) for k parameters, of which m = k − 1 if
    one is the size of a scatter, and N observations: the correction is that of a regression with
    one variance. The likelihood is scaled to the effective sample size n of the fit with the lowest
    AIC. NaN for a fit without a result, and if n <= m + 1, where the criterion does not exist.

    Source: Lebreton et al., Ecological Monographs 62, 67 (1992), for QAIC; Hurvich & Tsai,
    Biometrika 76, 297 (1989), for the correction for few observations.
    """
    converged = [each for each in estimates if bool(each.converged)]
    if not converged:
        return [np.nan] * len(estimates)
    reference = min(converged, key=lambda each: float(each.aic))
    n = reference.independent_observations
    share = n / int(reference.problem.observations)
    values = np.array([_criterion(each, n, share) for each in estimates])
    exist = np.isfinite(values)
    return (values - values[exist].min()).tolist() if exist.any() else values.tolist()


def fall(before: Estimate[Problem], after: Estimate[Problem]) -> float:
    """Fall of the criterion from one fit to another; NaN if it does not exist for both."""
    first, last = differences([before, after])
    return first - last


def rejected(estimates: Sequence[Estimate[Problem]]) -> list[bool]:
    """True for each fit that the best one rules out; all false if the best one is not usable. The
    correction for few observations alone rules out none.
    """
    behind = differences(estimates)
    best = estimates[best_first(estimates)[0]]
    share = best.independent_observations / int(best.problem.observations)
    return [
        bool(best.usable) and by >= CLEAR and float(each.aic - best.aic) * share >= CLEAR
        for by, each in zip(behind, estimates, strict=True)
    ]


def best_first(estimates: Sequence[Estimate[Problem]]) -> list[int]:
    """Indices of the fits in order: converged ones first, by the criterion; without one, by rms."""
    behind = differences(estimates)

    def place(i: int) -> tuple[bool, bool, float, float]:
        own = estimates[i]
        unknown = bool(np.isnan(behind[i]))
        by = float(own.rms) if unknown else behind[i]
        return not bool(own.converged), unknown, by, float(own.aic)

    return sorted(range(len(estimates)), key=place)


def parameters_found(estimate: Estimate[Problem]) -> int:
    """Number of parameters, of unknown noise variances and of sizes of scatter that a fit
    estimates.
    """
    sizes = estimate.problem.sizes_found + int(estimate.scatter is not None)
    return len(estimate.names) + sizes


def _criterion(estimate: Estimate[Problem], n: float, share: float) -> float:
    k = parameters_found(estimate)
    m = k - int(estimate.scatter is not None)
    if not bool(estimate.converged) or n <= m + 1:
        return np.nan
    return (float(estimate.aic) - 2 * k) * share + 2 * k + 2 * m * (m + 1) / (n - m - 1)
