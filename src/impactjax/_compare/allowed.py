"""Intervals that allow for what the record does not decide: dry friction that nobody denied, and
parameters that a fit held although others would lower the criterion a little.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from impactjax._compare.asked_for import freed, rubbed, slightly_asked_for, values_before
from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Settings, ranked
from impactjax._compare.oscillators import DRY_FRICTION
from impactjax._compare.prepare import WITH_DRY_FRICTION
from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import best_from
from impactjax._fit.scatter_test import with_normal_scatter
from impactjax._fit.uncertainty import holding
from impactjax._number_format import with_unit
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem


def allowing(
    plain: Mapping[str, Fitted],
    final: Mapping[str, Fitted],
    own: Mapping[str, Experiment],
    may_rub: frozenset[str],
    settings: Settings,
) -> tuple[dict[str, Fitted], list[str]]:
    """Fits whose intervals hold those with each undecided parameter, and sentences on them. Those
    of a free flight stay, since the parameters of no contact depend on what was held.

    **Arguments:**

    - `plain`: the fits without scatter.
    - `final`: the same fits with their intervals, and with scatter if that is needed.
    - `own`: the experiments.
    - `may_rub`: names of models of which nobody says whether there is dry friction.
    """
    best, said = ranked(final)[0].name, []
    rubs = {
        x
        for x, fitted in plain.items()
        if x in may_rub and not fitted.is_dry and x + WITH_DRY_FRICTION not in plain
    }

    def allowed(name: str) -> Fitted:
        fitted = final[name]
        before = plain[name].estimate
        has_result = bool(fitted.estimate.usable) and bool(before.converged)
        if fitted.is_free_flight or not has_result:
            return fitted
        for other, what in _variants(before, own[name], name in rubs, settings):
            more = _fitted_near(other, before, fitted.estimate.scatter is not None, settings)
            if not bool(more.usable):
                continue
            fitted = fitted._replace(estimate=_holding(fitted.estimate, more))
            if name == best:
                said.append(_words(what, more))
        return fitted

    found = dict(zip(final, settings.each(allowed, final), strict=True))
    return found, said


def _variants(
    estimate: Estimate[Problem], experiment: Experiment, rubs: bool, settings: Settings
) -> Iterator[tuple[Experiment, str]]:
    """The experiment with each parameter that is not decided, and its name."""
    if rubs:
        yield rubbed(experiment), DRY_FRICTION
    for held in slightly_asked_for(estimate, experiment, settings.search):
        yield freed(experiment, estimate.problem, [held]), held.name


def _fitted_near(
    experiment: Experiment, before: Estimate[Problem], scatters: bool, settings: Settings
) -> Estimate[Problem]:
    """The fit with one more parameter, from the values without."""
    problem = build_problem(experiment)
    lanes = problem.coordinates(values_before(problem, before)[None])
    found = best_from(problem, lanes, settings.optimiser, settings.search)
    return with_normal_scatter(found, settings.search) if scatters else found


def _holding(estimate: Estimate[Problem], other: Estimate[Problem]) -> Estimate[Problem]:
    """The estimate with intervals that hold those with one more parameter. Dry friction is never
    negative, so that it moves each value to one side only.
    """
    own = [other.names.index(name) for name in estimate.names]
    low, high = np.asarray(other.low)[own], np.asarray(other.high)[own]
    if DRY_FRICTION in other.names and DRY_FRICTION not in estimate.names:
        along = np.asarray(other.covariance)[own, other.names.index(DRY_FRICTION)]
        low = np.where(along < 0, low, np.asarray(estimate.low))
        high = np.where(along > 0, high, np.asarray(estimate.high))
    return holding(estimate, low, high)


def _words(name: str, after: Estimate[Problem]) -> str:
    """The sentence on a parameter for which intervals allow."""
    own, shown = after[name], name.replace("_", " ")
    if name != DRY_FRICTION:
        value = with_unit(f"{own.value:.4g}", own.unit)
        return f"Another {shown} is not excluded, such as {value}: all intervals allow for it."
    most = f" of up to {with_unit(f'{own.high:.2g}', own.unit)}" if np.isfinite(own.high) else ""
    return f"The record does not exclude {shown}{most}: all intervals allow for it."
