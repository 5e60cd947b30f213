"""Intervals across models that the recording cannot distinguish.

Each model gets its Akaike weight. Its distribution of a parameter is a normal one on each side of
the estimate, as wide as its own 95 % interval on that side.

Source: K. P. Burnham and D. R. Anderson (2002), "Model selection and multimodel inference", section
2.9, for the weights; D. Turek and D. Fletcher (2012), "Model-averaged Wald confidence intervals",
Computational Statistics and Data Analysis 56, 2809, for the intervals.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import special

from impactjax._compare.ranking import CLEAR, differences
from impactjax._fit.estimate import Estimate
from impactjax._fit.quantiles import bisected
from impactjax._fit.verdict import Verdict
from impactjax._problem.parameters import Handle
from impactjax._problem.problem import Problem

_TAIL = 0.025
_NORMAL = float(special.ndtri(1 - _TAIL))
_DIFFERENT = 0.1  # growth of an interval, relative to its width, that is worth a word
_CERTAIN = 40.0  # distance of a value without uncertainty, in half-widths
_BEYOND = 3.0  # distance of the search for an end, in half-widths


class Across(NamedTuple):
    """An interval of a parameter across several models.

    - `low`, `high`: ends of the 95 % interval; the end of the range, or infinity, if it is open.
    - `verdict`: sides from which all models together bound it.
    - `models`: indices of the models.
    """

    low: float
    high: float
    verdict: Verdict
    models: tuple[int, ...]


def across(estimates: Sequence[Estimate[Problem]]) -> dict[str, Across]:
    """Intervals of the parameters of the best model, across those that cannot be distinguished from
    it, where they are clearly wider than its own.

    Parameters of a contact law count as the same only in models with one type of law.

    **Arguments:**

    - `estimates`: estimates on one recording, the best first, as in a `Comparison`.

    Source: Burnham and Anderson (2002), "Model selection and multimodel inference", section 2.9;
    Turek and Fletcher, Computational Statistics and Data Analysis 56, 2809 (2012).
    """
    behind = differences(estimates)
    near = [i for i, by in enumerate(behind) if by < CLEAR and bool(estimates[i].usable)]
    if not near or near[0] != 0:
        return {}
    best = estimates[0]
    found = {}
    for name, handle in best.problem.handles().items():
        sharing = [i for i in near if _shares(estimates[i], best, name, handle)]
        if sharing[:1] != [0] or len(sharing) < 2:
            continue
        each = [estimates[i][name] for i in sharing]
        intervals = np.array([(x.value, x.low, x.high) for x in each])
        weights = np.exp(-np.array([behind[i] for i in sharing]) / 2)
        allowed, own = handle.allowed, each[0]
        low = min(own.low, max(mixture_end(intervals, weights, 0), allowed.low))
        high = max(own.high, min(mixture_end(intervals, weights, 1), allowed.high))
        if max(own.low - low, high - own.high) > _DIFFERENT * (own.high - own.low):
            verdict = _verdict(own.verdict, allowed.low < low, high < allowed.high)
            found[name] = Across(low, high, verdict, tuple(sharing))
    return found


def _verdict(own: Verdict, below: bool, above: bool) -> Verdict:
    """The verdict on an interval that contains that of the best model."""
    if own is Verdict.UNDECIDED or (below and above):
        return own
    return Verdict.ONE_SIDED if below or above else Verdict.NOT_IDENTIFIED


def _shares(
    estimate: Estimate[Problem], best: Estimate[Problem], name: str, handle: Handle
) -> bool:
    """True if a model has a parameter of the best one, with an interval that is known."""
    own = estimate.problem.handles().get(name)
    if own is None or own.path != handle.path:
        return False
    found = estimate[name]
    if np.isnan([found.low, found.high]).any() or not np.isfinite(found.standard_error):
        return False
    if "law" not in handle.path:
        return True
    stops = [getattr(each.problem.system.model, handle.path[1]) for each in (estimate, best)]
    return type(stops[0].law) is type(stops[1].law)


def mixture_end(
    intervals: Float[np.ndarray, "models 3"], weights: Float[np.ndarray, " models"], side: int
) -> float:
    """An end of the interval of a mixture, from value, low and high of each part."""
    values, lows, highs = intervals.T
    widths = np.stack([values - lows, highs - values])
    level = (_TAIL, 1 - _TAIL)[side]
    outward = np.where(np.isfinite(widths[side]), widths[side], 0.0)
    if np.sum(weights[~np.isfinite(widths[side])]) / np.sum(weights) > 2 * _TAIL:
        return (-np.inf, np.inf)[side]

    def probability(place: np.ndarray) -> np.ndarray:
        away = place - values
        width = np.where(away < 0, *widths)
        scaled = np.divide(away, width, out=_CERTAIN * np.sign(away), where=width > 0)
        share = np.sum(weights * special.ndtr(_NORMAL * scaled), keepdims=True)
        return share / np.sum(weights)

    reach = _BEYOND * np.max(outward)
    ends = np.min(values, keepdims=True) - reach, np.max(values, keepdims=True) + reach
    return float(bisected(probability, level, *ends)[0])
