"""Intervals that allow for what the record does not decide: dry friction that nobody denied, and
parameters that a fit held although others would lower the criterion a little.
"""

import dataclasses
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
from impactjax._fit.uncertainty import holding, within_ranges
from impactjax._number_format import with_unit
from impactjax._parameter import Range
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import Handle, handles, with_values
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
        start = values_before(problem, before)
        dry = _fitted_from(start, problem, scatters, settings)
        if bool(dry.usable):
            yield _with_friction(fitted.estimate, dry)
    for held in slightly_asked_for(before, experiment, settings.search):
        handle = handles(before.problem.system)[held.name]
        ends = _ends(held, handle.allowed)
        one, other = (_at(handle, end, before, scatters, settings) for end in ends)
        if bool(one.usable) and bool(other.usable):
            shown = " to ".join(with_unit(f"{end:.3g}", held.unit) for end in ends)
            yield _between(one, other, f"{held.name.replace('_', ' ')} from {shown}")


def _fitted_from(
    start: np.ndarray, problem: Problem, scatters: bool, settings: Settings
) -> Estimate[Problem]:
    """The fit of a problem from one start."""
    lanes = problem.coordinates(start[None])
    found = best_from(problem, lanes, settings.optimiser, settings.search)
    return with_normal_scatter(found, settings.search) if scatters else found


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


def _ends(held: HeldParameter, allowed: Range) -> tuple[float, float]:
    """Ends of the interval of a held parameter in linear approximation. A positive one is trusted
    to a factor of two.
    """
    half, least, most = NORMAL * held.standard_error, allowed.low, allowed.high
    if allowed.low == 0 < held.held:
        least, most = held.held / _FACTOR, held.held * _FACTOR
    value = np.clip(held.value, least, most)
    low, high = np.clip([value - half, value + half], least, most)
    return float(low), float(high)


def _at(
    handle: Handle,
    value: float,
    before: Estimate[Problem],
    scatters: bool,
    settings: Settings,
) -> Estimate[Problem]:
    """The fit with another value of a held parameter, by the programs of the fit before."""
    system = with_values(before.problem.system, [handle], [value])
    problem = dataclasses.replace(before.problem, system=system)
    return _fitted_from(np.asarray(before.values), problem, scatters, settings)


def _between(one: Estimate[Problem], other: Estimate[Problem], shown: str) -> _Intervals:
    """Intervals from fits at both ends of the interval of a held parameter: each value moves from
    one fit to the other, and has its own error beside that.
    """
    values, moved = (one.values + other.values) / 2, (other.values - one.values) / 2
    below = (one.values - one.low + other.values - other.low) / 2
    above = (one.high - one.values + other.high - other.values) / 2
    ends = values - np.hypot(below, moved), values + np.hypot(above, moved)
    low, high, _, _ = within_ranges(one.problem, *ends)
    sentence = f"A {shown} is not excluded: all intervals allow for it."
    return _Intervals(np.asarray(low), np.asarray(high), sentence)
