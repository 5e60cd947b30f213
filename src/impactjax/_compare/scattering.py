"""Scatter from impact to impact in a comparison: all models have it if the best one asks for it."""

from collections.abc import Mapping

from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Settings, ranked
from impactjax._compare.ranking import CLEAR, fall
from impactjax._fit.estimate import Estimate
from impactjax._fit.scatter_test import (
    as_held,
    assuming_scatter,
    follows_speed,
    may_scatter,
    with_normal_scatter,
)
from impactjax._fit.search import Search
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem


def with_likely_scatter(
    fitted: Fitted, experiment: Experiment, search: Search
) -> Estimate[Problem]:
    """The estimate with scatter if that is likelier and the experiment does not exclude it, else
    the estimate itself.
    """
    if experiment.scatter is not None:
        return fitted.estimate
    return assuming_scatter(fitted.estimate, search) or fitted.estimate


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
    experiment = own[before.name]
    plain = with_likely_scatter(before, experiment, search)
    if plain is before.estimate or not bool(plain.converged):
        return True
    return fall(plain, with_likely_scatter(after, experiment, search)) > enough


def scattering(
    fits: dict[str, Fitted], own: Mapping[str, Experiment], settings: Settings
) -> tuple[dict[str, Fitted], list[str]]:
    """All fits with scatter if the best one is likelier with it, and the sentence on that."""
    best = ranked(fits)[0]
    found = with_likely_scatter(best, own[best.name], settings.search)
    if found is best.estimate:
        return fits, []

    def scattered(fitted: Fitted) -> Fitted:
        wider = with_normal_scatter(fitted.estimate, settings.search)
        settled = bool(wider.converged) or not bool(found.converged)
        return fitted._replace(estimate=wider) if settled else fitted

    more = {
        name: each._replace(estimate=found) if name == best.name else scattered(each)
        for name, each in fits.items()
        if own[name].scatter is None and may_scatter(each.estimate)
    }
    return fits | more, [_words(best, found)]


def _words(best: Fitted, after: Estimate[Problem]) -> str:
    """The sentence on scatter that was fitted as well."""
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
    return (
        f"Whether restitution scatters from impact to impact is not decided: with a "
        f"scatter of {size} AIC falls by {held.gain:.0f} only. All intervals allow for it."
    )
