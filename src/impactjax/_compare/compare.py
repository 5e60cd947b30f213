"""The verb `compare`: several models on one recording, the best first."""

import dataclasses
from collections.abc import Mapping

import equinox as eqx

from impactjax._compare.allowed import allowing
from impactjax._compare.comparison import Comparison, Fitted
from impactjax._compare.enlarge import enlarged
from impactjax._compare.fit_models import Each, Progress, Settings, fit_models, ranked
from impactjax._compare.hints import hints
from impactjax._compare.holdout import fitted_part, prediction, prediction_of_another, share_of
from impactjax._compare.outliers_of_fit import without_outliers
from impactjax._compare.prepare import Prepared
from impactjax._compare.scattering import explains_more, with_intervals
from impactjax._fit.fit import check_search
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.experiment import Experiment
from impactjax._record.abstract_recording import AbstractRecording
from impactjax._refusal import check_kind

_ROUNDS = 3  # times that parameters left out are fitted as well


def compare(
    experiments: Prepared | Mapping[str, Experiment],
    *,
    starts: Starts = Starts(16),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
    holdout: float | Prepared = 0.0,
    progress: Progress = lambda _: None,
) -> Comparison:
    """Fits of several models to one recording, ranked, with intervals from profile likelihoods.

    A model that contains others as special cases is fitted after them; its searches also start from
    their results. Samples whose residuals in the best fit jump away from those beside them are left
    out, and all models fitted again. If the best fit held a parameter of the sensor or of a stop
    that the record asks for (`left_out`), and its experiment does not list it in `fixed`, all
    models are fitted again with it, and a note says so; likewise with dry friction, where `prepare`
    found that nobody decided about it, if it lowers the criterion by 10 or more, and more than
    those parameters do. If it lowers it by less, the best model is ranked with and without
    friction. If the residuals of an accelerometer exceed the noise, and nobody decided about a
    low-pass, one is fitted, and kept if it lowers the criterion by 10 or more. A change that
    scatter of restitution from impact to impact explains better is not made. If the experiment of
    the best model does not state scatter, it is fitted to all models that do not state it. They
    keep it if it lowers the criterion of the best one. If it does not, or by less than 10, and from
    four impacts on, the intervals hold those with and without it.

    **Arguments:**

    - `experiments`: result of `prepare`, or experiments by names of your own.
    - `starts`, `optimiser`: settings of the searches.
    - `holdout`: share of the observations, at the end of the recording, that is not fitted but
      predicted by each fit; or what `prepare` made of another recording of the same rig. To that
      one only the start of its motion is fitted, with the zero and drift of its sensor if they are
      fitted.
    - `progress`: function called with the name of each model when its search begins.

    **Raises** `ValueError` as `fit` does, for experiments that are not on one recording, and for a
    share or a recording that cannot be held out.
    """
    return compare_by(Search(), experiments, starts, optimiser, progress, map, holdout)


def compare_by(
    search: Search,
    experiments: Prepared | Mapping[str, Experiment],
    starts: Starts,
    optimiser: LevenbergMarquardt,
    progress: Progress,
    each: Each,
    holdout: float | Prepared = 0.0,
) -> Comparison:
    """Variant of `compare` with a given search. `each` maps a function over the models of a stage:
    `map`, or that of a pool of threads.
    """
    check_search(starts, optimiser)
    given = experiments.experiments if isinstance(experiments, Prepared) else experiments
    _check(given)
    may_rub, low_pass = frozenset[str](), None
    if isinstance(experiments, Prepared):
        may_rub, low_pass = experiments.may_rub, experiments.possible_low_pass
    share = share_of(holdout, [experiment.recording for experiment in given.values()])
    own = {name: _without_end(experiment, share) for name, experiment in given.items()}
    settings = Settings(starts, optimiser, search, progress, each)
    fits, said = fit_models(own, settings, {}), []
    for _ in range(_ROUNDS if fits else 0):
        change = without_outliers(own, fits, settings)
        if change is not None:
            own, fits, sentence = change
            said.append(sentence)
        change = enlarged(own, fits, may_rub, low_pass, settings)
        if change is None or not explains_more(fits, change.fits, own, search):
            break
        own, fits, sentence = change
        said.append(sentence)
    if fits:
        final, on_scatter = with_intervals(fits, own, settings)
        fits, on_others = allowing(fits, final, own, may_rub, settings)
        said += [*on_scatter, *on_others, *hints(fits)]
    if fits and holdout != 0:
        whole = next(iter(given.values())).recording

        def scored(fitted: Fitted) -> Fitted:
            return _scored(fitted, whole, holdout, settings)

        fits = dict(zip(fits, settings.each(scored, fits.values()), strict=True))
    comparison = Comparison("recording", tuple(ranked(fits)), notes=tuple(said), seed=starts.seed)
    if not isinstance(experiments, Prepared):
        return comparison
    name, look, notes = experiments.name, experiments.first_look, experiments.notes
    return dataclasses.replace(comparison, name=name, first_look=look, notes=(*notes, *said))


def _without_end(experiment: Experiment, share: float) -> Experiment:
    """The experiment without the last `share` of its observations."""
    if share == 0:
        return experiment
    return dataclasses.replace(experiment, recording=fitted_part(experiment.recording, share))


def _scored(
    fitted: Fitted, whole: AbstractRecording, holdout: float | Prepared, settings: Settings
) -> Fitted:
    """The fit with its prediction of what was held out."""
    starts, optimiser, search = settings.starts, settings.optimiser, settings.search
    if isinstance(holdout, Prepared):
        settings.progress(f"{fitted.name}, held out")
        found = prediction_of_another(fitted.estimate, holdout, starts, optimiser, search)
    else:
        found = prediction(fitted.estimate, whole, holdout, optimiser, search)
    return fitted._replace(prediction=found)


def _check(experiments: Mapping[str, Experiment]) -> None:
    if not isinstance(experiments, Mapping):
        raise TypeError(
            "Argument `experiments` must be what `prepare` made, or experiments by name, such as "
            '{"mine": experiment}.'
        )
    first: Experiment | None = None
    for name, each in experiments.items():
        check_kind(f"experiments[{name!r}]", each, Experiment, "Experiment(model, recording, ...)")
        first = first or each
        if not _same(first, each):
            raise ValueError(
                f"The recording of `{name}` is another one: only models of one recording can be "
                "ranked."
            )


def _same(one: Experiment, other: Experiment) -> bool:
    a, b = one.recording, other.recording
    return a is b or bool(eqx.tree_equal(a, b))
