"""The verb `repeatability`: comparisons of repeats → means, and the scatter between them."""

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._compare.across import mixture_end
from impactjax._compare.comparison import Comparison, Fitted
from impactjax._compare.ranking import CLEAR, differences
from impactjax._fit.random_effects import RandomEffects, random_effects
from impactjax._number_format import interval, with_error, with_unit
from impactjax._problem.parameters import Handle
from impactjax._refusal import check_kind

_SURE = 0.05  # probability below which results differ by more than their errors
_REMEDY = "compare(prepare(file))"


class RepeatedParameter(NamedTuple):
    """One parameter over all repeats, in its own unit.

    - `name`, `unit`: such as "gamma" and "1".
    - `values`, `errors`: result of each recording with its standard error; NaN where it has none.
    - `over`: mean over repeats, and the scatter between them.
    - `low`, `high`: 95 % interval of the mean; for the best model, across those that all recordings
      together cannot distinguish from it.
    """

    name: str
    unit: str
    values: Float[np.ndarray, " repeats"]
    errors: Float[np.ndarray, " repeats"]
    over: RandomEffects
    low: float
    high: float

    @property
    def differs(self) -> bool:
        """True if the results differ by more than their errors."""
        return self.over.chance < _SURE

    @property
    def quoted(self) -> str:
        """The mean with its standard error as text."""
        return with_error(self.over.mean, self.over.standard_error)

    @property
    def quoted_between(self) -> str:
        """The scatter between repeats with its interval as text."""
        low, high = self.over.between_low, self.over.between_high
        if low == 0:
            return f"less than {high:.2g}"
        return f"{self.over.between:.2g} ({low:.2g} to {high:.2g})"

    def __str__(self) -> str:
        ends = interval(self.low, self.high, self.over.standard_error)
        return (
            f"{self.name} = {with_unit(self.quoted, self.unit)} ({ends}), "
            f"between repeats {with_unit(self.quoted_between, self.unit)}"
        )


@dataclasses.dataclass(frozen=True)
class RepeatedModel:
    """One model over all repeats.

    - `name`: name of the model.
    - `behind`: its criterion, summed over the recordings, minus that of the best model.
    - `parameters`: those of oscillator, stops and law that two recordings or more determine.
    """

    name: str
    behind: float
    parameters: tuple[RepeatedParameter, ...]

    def __getitem__(self, name: str) -> RepeatedParameter:
        found = {each.name: each for each in self.parameters}
        if name not in found:
            raise KeyError(f"`{name}` has no mean over repeats; {', '.join(found)} have.")
        return found[name]


@dataclasses.dataclass(frozen=True)
class Repeatability:
    """Models over repeated recordings of one experiment, the best first.

    - `comparisons`: the comparison of each recording.
    - `models`: the models with a result for all recordings.
    - `notes`: sentences on models left out, and on results that differ.
    """

    comparisons: tuple[Comparison, ...]
    models: tuple[RepeatedModel, ...]
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the recordings."""
        return tuple(each.name for each in self.comparisons)

    def __getitem__(self, name: str) -> RepeatedModel:
        found = {each.name: each for each in self.models}
        if name not in found:
            raise KeyError(f"`{name}` was not fitted to all recordings; {', '.join(found)} were.")
        return found[name]

    def __str__(self) -> str:
        lines = []
        for model in self.models:
            lines.append(f"{model.name}, behind by {model.behind:.1f}:")
            lines += [f"  {each}" for each in model.parameters]
        return "\n".join([*lines, *self.notes])


def repeatability(comparisons: Sequence[Comparison]) -> Repeatability:
    """Means of the parameters over repeated recordings of one experiment, and the scatter between
    them.

    Each recording keeps its own fit, with its own initial state, sensor and scatter from impact to
    impact. The results of each model are combined by a random-effects model (`RandomEffects`): the
    intervals hold the mean of all conceivable repeats, not only of these. A mean over two repeats
    is uncertain, since two results hardly tell how much they scatter. Errors that all recordings
    share, such as a wrong length, are not in the intervals.

    Recordings that determine a parameter only together need `fit_together`.

    **Arguments:**

    - `comparisons`: results of `compare`, one for each recording, of the same models.

    **Raises** `ValueError` for fewer than two comparisons.
    """
    if isinstance(comparisons, Comparison):
        comparisons = [comparisons]
    for each in comparisons:
        check_kind("comparisons", each, Comparison, _REMEDY)
    if len(comparisons) < 2:
        raise ValueError("Repeatability needs the comparisons of at least two recordings.")
    common, left = _common(comparisons)
    if not common:
        nothing = "No model has a result for all recordings, so there are no means over them."
        return Repeatability(tuple(comparisons), (), (nothing, *left))
    criteria = np.sum([_criteria(each, common) for each in comparisons], axis=0)
    behind = criteria - np.min(criteria)
    order = np.argsort(behind, kind="stable")
    models = [
        RepeatedModel(common[i], float(behind[i]), _parameters(comparisons, common[i]))
        for i in order
    ]
    models[0] = dataclasses.replace(models[0], parameters=_across(models, comparisons))
    return Repeatability(tuple(comparisons), tuple(models), (*left, *_differing(models[0])))


def _common(comparisons: Sequence[Comparison]) -> tuple[list[str], list[str]]:
    """Names of the models with a result for all recordings, and sentences on the others."""
    known = list(dict.fromkeys(fitted.name for each in comparisons for fitted in each))
    common, left = [], []
    for name in known:
        lacking = [each.name for each in comparisons if not _has_result(each, name)]
        if lacking:
            left.append(f"{name} has no result for {', '.join(lacking)}.")
        else:
            common.append(name)
    return common, left


def _has_result(comparison: Comparison, name: str) -> bool:
    return any(
        fitted.name == name and bool(fitted.estimate.usable) and not fitted.worse_than
        for fitted in comparison
    )


def _criteria(comparison: Comparison, names: Sequence[str]) -> list[float]:
    """The criterion of each model on one recording; that of few observations need not exist."""
    estimates = [comparison[name].estimate for name in names]
    behind = differences(estimates)
    return behind if np.isfinite(behind).all() else [float(each.aic) for each in estimates]


def _parameters(comparisons: Sequence[Comparison], name: str) -> tuple[RepeatedParameter, ...]:
    fits = [each[name] for each in comparisons]
    handles: dict[str, Handle] = {}
    for fitted in fits:
        handles |= fitted.estimate.problem.handles()
    found = [_parameter(fits, own, handle) for own, handle in handles.items() if _is_shared(handle)]
    return tuple(each for each in found if each is not None)


def _is_shared(handle: Handle) -> bool:
    """True for a parameter of oscillator, stop or law."""
    return handle.path[0] == "model"


def _parameter(fits: Sequence[Fitted], name: str, handle: Handle) -> RepeatedParameter | None:
    """The parameter over all repeats; `None` if fewer than two determine it."""
    results = [_result(fitted, name) for fitted in fits]
    values, errors = (np.array(column) for column in zip(*results, strict=True))
    told = np.isfinite(values) & np.isfinite(errors) & (errors > 0)
    if np.sum(told) < 2:
        return None
    over, allowed = random_effects(values[told], errors[told]), handle.allowed
    low, high = max(over.low, allowed.low), min(over.high, allowed.high)
    over = over._replace(
        single_low=max(over.single_low, allowed.low),
        single_high=min(over.single_high, allowed.high),
    )
    values, errors = np.where(told, values, np.nan), np.where(told, errors, np.nan)
    return RepeatedParameter(name, allowed.unit, values, errors, over, low, high)


def _result(fitted: Fitted, name: str) -> tuple[float, float]:
    if name not in fitted.estimate.names:
        return math.nan, math.nan
    own = fitted.estimate[name]
    return own.value, own.standard_error


def _across(
    models: Sequence[RepeatedModel], comparisons: Sequence[Comparison]
) -> tuple[RepeatedParameter, ...]:
    """The parameters of the best model, with intervals across those that cannot be distinguished
    from it.
    """
    near = [each for each in models if each.behind < CLEAR]
    laws = [_laws(comparisons, each.name) for each in near]
    return tuple(_widened(each, near, laws) for each in models[0].parameters)


def _widened(
    own: RepeatedParameter, near: Sequence[RepeatedModel], laws: Sequence[dict[str, object]]
) -> RepeatedParameter:
    sharing = [
        (each.behind, found)
        for each, law in zip(near, laws, strict=True)
        for found in each.parameters
        if found.name == own.name and law.get(own.name) == laws[0].get(own.name)
    ]
    intervals = np.array([(found.over.mean, found.low, found.high) for _, found in sharing])
    weights = np.exp(-np.array([behind for behind, _ in sharing]) / 2)
    low, high = (mixture_end(intervals, weights, side) for side in (0, 1))
    return own._replace(low=min(own.low, low), high=max(own.high, high))


def _laws(comparisons: Sequence[Comparison], name: str) -> dict[str, object]:
    """For each parameter of a law, the type of that law."""
    problem = comparisons[0][name].estimate.problem
    stops = {side: getattr(problem.system.model, side) for side in ("lower", "upper")}
    return {
        own: type(stops[handle.path[1]].law)
        for own, handle in problem.handles().items()
        if "law" in handle.path
    }


def _differing(model: RepeatedModel) -> list[str]:
    """A sentence on the parameters of a model whose results differ."""
    names = [each.name for each in model.parameters if each.differs]
    if not names:
        return []
    verb = "differs" if len(names) == 1 else "differ"
    return [f"{', '.join(names)} of {model.name} {verb} between repeats by more than the errors."]
