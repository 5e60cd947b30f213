"""Scatter from impact to impact in a comparison: allowed for in all models, unless it is stated."""

from collections.abc import Mapping

import numpy as np

from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Settings, ranked
from impactjax._compare.ranking import CLEAR, fall
from impactjax._fit.estimate import Estimate
from impactjax._fit.scatter_test import (
    as_held,
    assuming_scatter,
    follows_speed,
    is_likely,
    may_scatter,
    with_normal_scatter,
)
from impactjax._fit.search import Search
from impactjax._fit.uncertainty import holding_both
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem

_FEWEST = 4  # impacts that tell how far restitution may scatter without being noticed


def explains_more(
    fits: Mapping[str, Fitted],
    more: Mapping[str, Fitted],
    own: Mapping[str, Experiment],
    search: Search,
) -> bool:
    """True if fits with more parameters still lower the criterion when both have scatter where it
    is likelier, and do so clearly if they did. Scatter may explain what the parameters seemed to.
    """
    before, after = ranked(fits)[0], ranked(more)[0]
    enough = CLEAR if fall(before.estimate, after.estimate) >= CLEAR else 0.0
    if own[before.name].scatter is not None:
        return True
    plain = assuming_scatter(before.estimate, search)
    if plain is None or not bool(plain.converged):
        return True
    scattered = assuming_scatter(after.estimate, search)
    return fall(plain, scattered or after.estimate) > enough


def with_intervals(
    fits: Mapping[str, Fitted], own: Mapping[str, Experiment], settings: Settings
) -> tuple[dict[str, Fitted], list[str]]:
    """All fits with intervals that allow for scatter where it is not stated, and the sentence on
    that.

    If the best fit asks for scatter clearly, all fits get it. If it is not decided, the intervals
    hold those of the profile likelihood without scatter and those with it, since scatter that is
    too small to be noticed moves other parameters; the fits are those that are likelier for the
    best one. Two or three impacts do not tell how large unnoticed scatter may be: their intervals
    allow for it only if it is likelier.
    """
    best = ranked(fits)[0]
    found = with_normal_scatter(best.estimate, settings.search) if _may_scatter(best, own) else None
    likely = found is not None and is_likely(best.estimate, found)
    several = int(np.asarray(best.estimate.impacts.count)) >= _FEWEST
    if found is None or not (likely or (several and bool(found.converged))):
        profiled = settings.each(settings.profiled, fits.values())
        return dict(zip(fits, profiled, strict=True)), []
    needed = as_held(best.estimate, found).is_needed

    def finished(fitted: Fitted) -> Fitted:
        if not _may_scatter(fitted, own):
            return settings.profiled(fitted)
        is_best = fitted.name == best.name
        wider = found if is_best else with_normal_scatter(fitted.estimate, settings.search)
        if bool(found.converged) and not bool(wider.converged):
            return settings.profiled(fitted)
        if needed:
            return fitted._replace(estimate=wider)
        plain = settings.profiled(fitted)
        both = (wider, plain.estimate) if likely else (plain.estimate, wider)
        return plain._replace(estimate=holding_both(*both))

    more = dict(zip(fits, settings.each(finished, fits.values()), strict=True))
    return more, [_words(best, found)]


def _may_scatter(fitted: Fitted, own: Mapping[str, Experiment]) -> bool:
    return own[fitted.name].scatter is None and may_scatter(fitted.estimate)


def _words(best: Fitted, after: Estimate[Problem]) -> str:
    """The sentence on scatter that was allowed for."""
    held = as_held(best.estimate, after)
    if not bool(after.converged):
        return (
            f"The record asks for scatter of restitution from impact to impact: AIC of {best.name} "
            f"falls by {held.gain:.0f}. But that fit is {after.cause}, so that it identifies "
            f"nothing."
        )
    size = str(after.scatter).removeprefix("scatter from impact to impact: ")
    if held.is_needed:
        wrong = (
            " The deviations follow the speed: the law is wrong." if follows_speed(after) else ""
        )
        return (
            f"The record asks for scatter of restitution from impact to impact of {size}: AIC "
            f"falls by {held.gain:.0f}.{wrong}"
        )
    if held.gain > 0:
        return (
            f"Whether restitution scatters from impact to impact is not decided: with a "
            f"scatter of {size} AIC falls by {held.gain:.0f} only. All intervals allow for it."
        )
    return (
        f"The record does not ask for scatter of restitution from impact to impact, but would not "
        f"show a small one ({size}): all intervals allow for it."
    )
