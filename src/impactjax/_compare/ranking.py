"""The criterion that ranks laws, and the one difference of it that tells them apart."""

from collections.abc import Sequence

import numpy as np

from impactjax._fit.estimate import Estimate

CLEAR = 10.0  # a difference of the criterion that leaves no doubt


def differences(estimates: Sequence[Estimate]) -> list[float]:
    """By how much the criterion of each fit is worse than the best one's; at least zero.

    The criterion is Akaike's for correlated residuals and for few of them,
    share (−2 log L) + 2 k + 2 k (k + 1)/(n − k − 1). The n are the independent residuals which
    those of the fit with the lowest AIC stand for, and `share` is their share of all. NaN for a fit
    that has no result, and where n <= k + 1: there the criterion does not exist and decides
    nothing.

    Source: Lebreton et al., Ecological Monographs 62, 67 (1992); Hurvich & Tsai, Biometrika 76,
    297 (1989).
    """
    converged = [each for each in estimates if bool(each.converged)]
    if not converged:
        return [np.nan] * len(estimates)
    reference = min(converged, key=lambda each: float(each.aic))
    n = independent_observations(reference)
    share = n / int(reference.problem.observations)
    values = np.array([_criterion(each, n, share) for each in estimates])
    exist = np.isfinite(values)
    return (values - values[exist].min()).tolist() if exist.any() else values.tolist()


def rejected(estimates: Sequence[Estimate]) -> list[bool]:
    """Which fits the best one rules out: none if that has no result, or misses the record."""
    behind = differences(estimates)
    best = estimates[best_first(estimates)[0]]
    return [bool(best.usable) and by >= CLEAR for by in behind]


def best_first(estimates: Sequence[Estimate]) -> list[int]:
    """The order of fits: those with a result by the criterion, then by their residuals."""
    behind = differences(estimates)

    def place(i: int) -> tuple[bool, bool, float, float]:
        own = estimates[i]
        unknown = bool(np.isnan(behind[i]))
        by = float(own.rms) if unknown else behind[i]
        return not bool(own.converged), unknown, by, float(own.aic)

    return sorted(range(len(estimates)), key=place)


def independent_observations(estimate: Estimate) -> float:
    """How many independent residuals those of a fit stand for."""
    n = float(estimate.problem.observations)
    return min(float(estimate.freedom) + len(estimate.names), n)


def parameters_found(estimate: Estimate) -> int:
    """What a fit finds in a record: parameters, and sizes of noise that are not known."""
    return len(estimate.names) + estimate.problem.sizes_found


def _criterion(estimate: Estimate, n: float, share: float) -> float:
    k = parameters_found(estimate)
    if not bool(estimate.converged) or n <= k + 1:
        return np.nan
    return (float(estimate.aic) - 2 * k) * share + 2 * k + 2 * k * (k + 1) / (n - k - 1)
