"""The verb `compare`: several models on one recording, the best first."""

import dataclasses
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from impactjax._compare.asked_for import (
    asked_for,
    freed,
    friction,
    rubbed,
    undecided,
    values_before,
    words,
)
from impactjax._compare.comparison import Comparison, Fitted
from impactjax._compare.holdout import check_holdout, fitted_part, prediction
from impactjax._compare.nested import in_stages, special_case
from impactjax._compare.prepare import WITH_DRY_FRICTION, Prepared
from impactjax._compare.ranking import CLEAR, best_first
from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import best_from, check_search, scattered
from impactjax._fit.profile import profiled_by
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._fit.verdict import Verdict
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._outcome import Outcome
from impactjax._problem.build_problem import build_problem
from impactjax._problem.checks import check_no_priors
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem
from impactjax._refusal import check_kind

_DAMPED = 3.0  # damping ratio, in standard errors, from which friction may stand behind it
_ROUNDS = 3  # times that parameters left out are fitted as well
_LINEARISED = 1.0  # difference of −2 log L that may come from the linearisation of scatter
_ROUNDING = 1e-6  # relative difference of two rms that counts as rounding

Progress = Callable[[str], None]
Each = Callable[..., Iterable[Any]]


def compare(
    experiments: Prepared | Mapping[str, Experiment],
    *,
    starts: Starts = Starts(16),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
    holdout: float = 0.0,
    progress: Progress = lambda _: None,
) -> Comparison:
    """Fits of several models to one recording, ranked, with intervals from profile likelihoods.

    A model that contains others as special cases is fitted after them; its searches also start from
    their results. If the best fit held a parameter of the sensor or of a stop that the record asks
    for (`left_out`), and its experiment does not list it in `fixed`, all models are fitted again
    with it, and a note says so; likewise with dry friction, if residuals stay autocorrelated
    without it, or the damping ratio exceeds three standard errors, and if it lowers the criterion
    by 10 or more, and more than those parameters do. If it lowers it by less, the best model is
    ranked with and without friction.

    **Arguments:**

    - `experiments`: result of `prepare`, or experiments by names of your own.
    - `starts`, `optimiser`: settings of the searches.
    - `holdout`: share of the observations, at the end of the recording, that is not fitted but
      predicted by each fit.
    - `progress`: function called with the name of each model when its search begins.

    **Raises** `ValueError` as `fit` does, and for experiments that are not on one recording.
    """
    return compare_by(Search(), experiments, starts, optimiser, progress, map, holdout)


def compare_by(
    search: Search,
    experiments: Prepared | Mapping[str, Experiment],
    starts: Starts,
    optimiser: LevenbergMarquardt,
    progress: Progress,
    each: Each,
    holdout: float = 0.0,
) -> Comparison:
    """Variant of `compare` with a given search. `each` maps a function over the models of a stage:
    `map`, or that of a pool of threads.
    """
    check_search(starts, optimiser)
    check_holdout(holdout)
    given = experiments.experiments if isinstance(experiments, Prepared) else experiments
    _check(given)
    may_rub = experiments.may_rub if isinstance(experiments, Prepared) else frozenset[str]()
    own = {name: _without_end(experiment, holdout) for name, experiment in given.items()}
    settings = _Settings(starts, optimiser, search, progress, each)
    fits, said = _fits(own, settings, {}), []
    for _ in range(_ROUNDS if fits else 0):
        change = _freed(own, fits, may_rub, settings)
        if change is None:
            break
        own, fits, sentence = change
        said.append(sentence)
    fits = dict(zip(fits, each(settings.with_intervals, fits.values()), strict=True))
    if holdout > 0:
        fits = {x: _scored(fits[x], given[x], settings) for x in fits}
    ranked = Comparison("recording", tuple(_ranked(fits)), notes=tuple(said), seed=starts.seed)
    if not isinstance(experiments, Prepared):
        return ranked
    name, look, notes = experiments.name, experiments.first_look, experiments.notes
    return dataclasses.replace(ranked, name=name, first_look=look, notes=(*notes, *said))


class _Settings(NamedTuple):
    """The arguments of a comparison that say how to search."""

    starts: Starts
    optimiser: LevenbergMarquardt
    search: Search
    progress: Progress
    each: Each

    def with_intervals(self, fitted: Fitted) -> Fitted:
        """The fit with intervals from the profile likelihood."""
        begin = time.perf_counter()
        estimate = profiled_by(self.search, fitted.estimate, self.optimiser)
        seconds = fitted.seconds + time.perf_counter() - begin
        return fitted._replace(estimate=estimate, seconds=seconds)


def _without_end(experiment: Experiment, share: float) -> Experiment:
    """The experiment without the last `share` of its observations."""
    if share == 0:
        return experiment
    return dataclasses.replace(experiment, recording=fitted_part(experiment.recording, share))


def _scored(fitted: Fitted, whole: Experiment, settings: _Settings) -> Fitted:
    """The fit with its prediction of the part that was held out."""
    found = prediction(fitted.estimate, whole.recording, settings.optimiser, settings.search)
    return fitted._replace(prediction=found)


class _Change(NamedTuple):
    """Experiments with more parameters to fit, their fits, and the sentence on them."""

    own: dict[str, Experiment]
    fits: dict[str, Fitted]
    sentence: str


def _freed(
    own: dict[str, Experiment],
    fits: dict[str, Fitted],
    may_rub: frozenset[str],
    settings: _Settings,
) -> _Change | None:
    """The change that the best fit asks for: parameters that it held, or dry friction if that
    lowers the criterion more; `None` without need. Friction that lowers it, but not clearly, is
    one more model.
    """
    best, change = _ranked(fits)[0], None
    found = asked_for(best.estimate, own[best.name], settings.search)
    if found:
        wider = {x: freed(own[x], fits[x].estimate.problem, found) for x in own}
        more = _fits(wider, settings, fits)
        if _is_better(_ranked(more)[0].estimate, best.estimate):
            sentence = words(found, best.estimate, more[best.name].estimate)
            change = _Change(wider, more, sentence)
    left = best if change is None else _ranked(change.fits)[0]
    variant = best.name + WITH_DRY_FRICTION
    if best.is_dry or best.name not in may_rub or variant in own or not _may_lack(left.estimate):
        return change
    with_friction = {variant: rubbed(own[best.name])}
    dry = _fits(with_friction, settings, {variant: best})
    needs = friction(best.estimate, dry[variant].estimate)
    if not _is_better(dry[variant].estimate, left.estimate):
        return change
    if needs.gain >= CLEAR:
        own = {name: rubbed(each) if name in may_rub else each for name, each in own.items()}
        said = words([needs], best.estimate, dry[variant].estimate)
        return _Change(own, _fits(own, settings, fits), said)
    if change is not None:
        return change
    return _Change(own | with_friction, fits | dry, undecided(needs))


def _may_lack(estimate: Estimate[Problem]) -> bool:
    """True if a fit without dry friction may need it: its residuals are autocorrelated, or there is
    more viscous damping than its error explains.
    """
    damped = [estimate[name] for name in estimate.names if name == "zeta"]
    return int(estimate.memory) > 0 or any(x.value > _DAMPED * x.standard_error for x in damped)


def _ranked(fits: Mapping[str, Fitted]) -> list[Fitted]:
    """Fits in the order of the criterion."""
    all_fits = list(fits.values())
    return [all_fits[i] for i in best_first([fit.estimate for fit in all_fits])]


def _fits(
    experiments: Mapping[str, Experiment], settings: _Settings, before: Mapping[str, Fitted]
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


def _check(experiments: Mapping[str, Experiment]) -> None:
    if not isinstance(experiments, Mapping):
        raise TypeError(
            "Argument `experiments` must be what `prepare` made, or experiments by name, such as "
            '{"mine": experiment}.'
        )
    first: Experiment | None = None
    for name, each in experiments.items():
        check_kind(f"experiments[{name!r}]", each, Experiment, "Experiment(model, recording, ...)")
        check_no_priors(each)
        first = first or each
        if not _same(first, each):
            raise ValueError(
                f"The recording of `{name}` is another one: only models of one recording can be "
                "ranked."
            )


def _same(one: Experiment, other: Experiment) -> bool:
    a, b = one.recording, other.recording
    return a is b or bool(eqx.tree_equal(a, b))


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


def _is_better(estimate: Estimate[Problem], before: Estimate[Problem]) -> bool:
    return bool(estimate.converged) and float(estimate.aic) < float(before.aic)


def _is_worse(estimate: Estimate[Problem], special: Estimate[Problem]) -> bool:
    """True if an estimate describes the record worse than one of its special cases. Residuals with
    scatter are those after all expected deviations, so that the likelihood decides.
    """
    if estimate.scatter is not None:
        return not _deviance(estimate) <= _deviance(special) + _LINEARISED
    return not float(estimate.rms) <= (1 + _ROUNDING) * float(special.rms)


def _deviance(estimate: Estimate[Problem]) -> float:
    """−2 log L plus a constant."""
    return float(estimate.aic) - 2 * len(estimate.names)


def _estimated(
    problem: Problem, settings: _Settings, cases: Sequence[np.ndarray]
) -> Estimate[Problem]:
    """The best of searches from scattered starts and from special cases."""
    starts, optimiser, search = settings.starts, settings.optimiser, settings.search
    beside = problem.coordinates(np.stack(cases)) if cases else None
    found = best_from(problem, starts.lanes(problem), optimiser, search, beside)
    return scattered(found, optimiser, search)
