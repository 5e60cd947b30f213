"""Intervals that allow for what the record does not decide: dry friction that nobody denied, and
parameters that a fit held although others would lower the criterion a little.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from impactjax._compare.asked_for import rubbed, slightly_asked_for, values_before
from impactjax._compare.comparison import Fitted
from impactjax._compare.fit_models import Settings, ranked
from impactjax._compare.oscillators import DRY_FRICTION
from impactjax._compare.prepare import WITH_DRY_FRICTION
from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import best_from
from impactjax._fit.quantiles import NORMAL
from impactjax._fit.scatter_test import with_normal_scatter
from impactjax._fit.score_test import HeldParameter
from impactjax._fit.straight import raised, slope_of, straight
from impactjax._fit.uncertainty import holding
from impactjax._number_format import with_unit
from impactjax._parameter import Range
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem

_FACTOR = 2.0  # to which a positive value is trusted that somebody stated


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
        for more in _intervals(before, own[name], fitted, name in rubs, settings):
            fitted = fitted._replace(estimate=holding(fitted.estimate, more.low, more.high))
            if name == best:
                said.append(more.sentence)
        return fitted

    found = dict(zip(final, settings.each(allowed, final), strict=True))
    return found, said


class _Intervals(NamedTuple):
    """Ends of the intervals with one more parameter, and the sentence on it."""

    low: np.ndarray
    high: np.ndarray
    sentence: str


def _intervals(
    before: Estimate[Problem],
    experiment: Experiment,
    fitted: Fitted,
    rubs: bool,
    settings: Settings,
) -> Iterator[_Intervals]:
    """The intervals with each parameter that is not decided."""
    scatters = fitted.estimate.scatter is not None
    if rubs:
        problem = build_problem(rubbed(experiment))
        lanes = problem.coordinates(values_before(problem, before)[None])
        dry = best_from(problem, lanes, settings.optimiser, settings.search)
        dry = with_normal_scatter(dry, settings.search) if scatters else dry
        if bool(dry.usable):
            yield _with_friction(fitted.estimate, dry)
    known = handles(before.problem.system)
    for held, effect in slightly_asked_for(fitted.estimate, experiment, settings.search):
        yield _over(held, known[held.name].allowed, fitted.estimate, effect)


def _with_friction(estimate: Estimate[Problem], dry: Estimate[Problem]) -> _Intervals:
    """Intervals with dry friction. It is never negative, so that it moves each value to one side
    only.
    """
    own = [dry.names.index(name) for name in estimate.names]
    along = np.asarray(dry.covariance)[own, dry.names.index(DRY_FRICTION)]
    low = np.where(along < 0, np.asarray(dry.low)[own], np.asarray(estimate.low))
    high = np.where(along > 0, np.asarray(dry.high)[own], np.asarray(estimate.high))
    each = dry[DRY_FRICTION]
    most = f" of up to {with_unit(f'{each.high:.2g}', each.unit)}" if np.isfinite(each.high) else ""
    sentence = f"The record does not exclude dry friction{most}: all intervals allow for it."
    return _Intervals(low, high, sentence)


def _over(
    held: HeldParameter, allowed: Range, estimate: Estimate[Problem], effect: np.ndarray
) -> _Intervals:
    """Intervals over the 95 % interval of a held parameter: by its effect, the straight coordinate
    of each parameter moves from one end to the other, and has its own error beside that.
    """
    ends, away = _span(held, allowed)
    axes, values = straight(estimate.problem), np.asarray(estimate.values)
    places, effect = axes.places(values), effect / axes.slopes(values)
    least, most = axes.span(np.asarray(estimate.low), np.asarray(estimate.high))
    middle, moved = places + effect * np.mean(away), effect * (away[1] - away[0]) / 2
    low, high = axes.interval(
        middle - np.hypot(places - least, moved), middle + np.hypot(most - places, moved)
    )
    shown = " to ".join(with_unit(f"{end:.3g}", held.unit) for end in ends)
    name = held.name.replace("_", " ")
    sentence = f"A {name} from {shown} is not excluded: all intervals allow for it."
    return _Intervals(low, high, sentence)


def _span(held: HeldParameter, allowed: Range) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 95 % interval of a held parameter, and their distances from its value in a
    straight coordinate that has the slope of the value there. A positive one is trusted to a factor
    of two.
    """
    half, value = NORMAL * held.standard_error, held.held
    least, most = allowed.low, allowed.high
    if allowed.low == 0 < value:
        least, most = value / _FACTOR, value * _FACTOR
    power, limits, at = allowed.power, np.array([least, most]), np.asarray(value)
    place, slope = raised(at, power), slope_of(at, power)
    limits = (raised(limits, power) - place) * slope
    ends = np.clip(held.value - value, *limits) + np.array([-half, half])
    away = np.clip(ends, *limits)
    return raised(place + away / slope, 1 / power), away
