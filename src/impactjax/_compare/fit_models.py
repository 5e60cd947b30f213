"""Fits of several models to one recording, each after those of its special cases."""

import dataclasses
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from impactjax._compare.asked_for import values_before
from impactjax._compare.comparison import Fitted
from impactjax._compare.nested import in_stages, special_case
from impactjax._compare.ranking import best_first
from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import best_from, scattered
from impactjax._fit.profile import profiled_by
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._fit.verdict import Verdict
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._outcome import Outcome
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem

_LINEARISED = 1.0  # difference of −2 log L that may come from the linearisation of scatter
_ROUNDING = 1e-6  # relative difference of two rms that counts as rounding

Progress = Callable[[str], None]
Each = Callable[..., Iterable[Any]]


class Settings(NamedTuple):
    """The arguments of a comparison that say how to search."""

    starts: Starts
    optimiser: LevenbergMarquardt
    search: Search
    progress: Progress
    each: Each

    def profiled(self, fitted: Fitted) -> Fitted:
        """The fit with intervals from the profile likelihood."""
        begin = time.perf_counter()
        estimate = profiled_by(self.search, fitted.estimate, self.optimiser)
        seconds = fitted.seconds + time.perf_counter() - begin
        return fitted._replace(estimate=estimate, seconds=seconds)


class Change(NamedTuple):
    """Changed experiments, their fits, and the sentence on the change."""

    own: dict[str, Experiment]
    fits: dict[str, Fitted]
    sentence: str


def ranked(fits: Mapping[str, Fitted]) -> list[Fitted]:
    """Fits in the order of the criterion."""
    all_fits = list(fits.values())
    return [all_fits[i] for i in best_first([fit.estimate for fit in all_fits])]


def fit_models(
    experiments: Mapping[str, Experiment], settings: Settings, before: Mapping[str, Fitted]
) -> dict[str, Fitted]:
    """The fit of each model, after those of its special cases.

    `before` has fits of the same models with fewer parameters, from which searches start as well.
    """
    done: dict[str, Fitted] = {}

    def fitted(name: str) -> Fitted:
        settings.progress(name)
        begin = time.perf_counter()
        problem, stated = build_problem(experiments[name]), tuple(experiments[name].fixed)
        cases = _special_cases(problem, done)
        places = [values for values, _ in cases.values()]
        if name in before:
            places.append(values_before(problem, before[name].estimate))
        estimate = _estimated(problem, settings, places)
        better = tuple(small for small, (_, of) in cases.items() if _is_worse(estimate, of))
        if better:
            nothing = jnp.full_like(estimate.verdicts, Verdict.NOT_IDENTIFIED)
            worse, own = Outcome.WORSE_THAN_SPECIAL_CASE, estimate.outcome
            outcome = jnp.where(estimate.converged, worse, own).astype(own.dtype)
            estimate = dataclasses.replace(estimate, outcome=outcome, verdicts=nothing)
        return Fitted(name, estimate, time.perf_counter() - begin, stated, better)

    for stage in in_stages({name: each.model for name, each in experiments.items()}):
        done |= dict(zip(stage, settings.each(fitted, stage), strict=True))
    return done


def _special_cases(
    problem: Problem, done: Mapping[str, Fitted]
) -> dict[str, tuple[np.ndarray, Estimate[Problem]]]:
    """The fitted special cases of a model, by name: its parameter values, and the estimate."""
    found = {}
    for name, fitted in done.items():
        if bool(fitted.estimate.converged):
            values = special_case(problem, fitted.estimate)
            if values is not None:
                found[name] = (values, fitted.estimate)
    return found


def _is_worse(estimate: Estimate[Problem], special: Estimate[Problem]) -> bool:
    """True if an estimate describes the record worse than one of its special cases. Residuals with
    scatter are those after all expected deviations, and prior knowledge is none of them: then the
    likelihood decides. A model without scatter has no special case with it, nor one with prior
    knowledge of other parameters.
    """
    other = estimate.problem.priors.keys() != special.problem.priors.keys()
    if other or (estimate.scatter is None and special.scatter is not None):
        return False
    if estimate.scatter is not None or estimate.problem.priors:
        return not _deviance(estimate) <= _deviance(special) + _LINEARISED
    return not float(estimate.rms) <= (1 + _ROUNDING) * float(special.rms)


def _deviance(estimate: Estimate[Problem]) -> float:
    """−2 log L plus a constant."""
    return float(estimate.aic) - 2 * len(estimate.names)


def _estimated(
    problem: Problem, settings: Settings, cases: Sequence[np.ndarray]
) -> Estimate[Problem]:
    """The best of searches from scattered starts and from special cases."""
    starts, optimiser, search = settings.starts, settings.optimiser, settings.search
    beside = problem.coordinates(np.stack(cases)) if cases else None
    found = best_from(problem, starts.lanes(problem), optimiser, search, beside)
    return scattered(found, search)
