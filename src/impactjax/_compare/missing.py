"""Parameters that the best of several fits left out, and all fits repeated with them."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._fit.left_out import HeldParameter, needed
from impactjax._fit.search import Search
from impactjax._number_format import with_error, with_unit
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem

_MOVED = 1.0  # change of a value, in standard errors, that is worth a word


def missing(
    estimate: Estimate[Problem], experiment: Experiment, search: Search
) -> list[HeldParameter]:
    """The parameters that the record asks for beside those fitted and those stated by the user."""
    if not bool(estimate.usable):
        return []
    return needed(estimate, tuple(experiment.fixed), search)


def with_missing(
    experiment: Experiment, problem: Problem, found: Sequence[HeldParameter]
) -> Experiment:
    """The experiment with more parameters to fit, those that its model has."""
    names = [each.name for each in found if each.name in handles(problem.system)]
    return dataclasses.replace(experiment, free=tuple(dict.fromkeys([*experiment.free, *names])))


def values_before(problem: Problem, estimate: Estimate[Problem]) -> np.ndarray:
    """The values of a problem's parameters at an estimate with fewer of them."""
    known = handles(estimate.system)
    return np.array([float(known[name].get(estimate.system)) for name in problem.names])


def missing_words(
    found: Sequence[HeldParameter], before: Estimate[Problem], after: Estimate[Problem]
) -> str:
    """The sentence on what was fitted as well, by how much it matters, and with what effect."""
    freed = [_freed(each, after) for each in found if each.name in after.names]
    gain = float(before.aic - after.aic)
    moved = [
        _moved(name, before, after) for name in before.names if _has_moved(name, before, after)
    ]
    effect = f" {'; '.join(moved)}." if moved else " No other value changes by its standard error."
    return f"The record asks for {' and '.join(freed)}: AIC falls by {gain:.0f}.{effect}"


def _freed(held: HeldParameter, after: Estimate[Problem]) -> str:
    own = after[held.name]
    shown = with_unit(with_error(own.value, own.standard_error), own.unit)
    return f"`{held.name}` = {shown} instead of {held.held:.4g}"


def _has_moved(name: str, before: Estimate[Problem], after: Estimate[Problem]) -> bool:
    error = before[name].standard_error
    return bool(abs(after[name].value - before[name].value) > _MOVED * error)


def _moved(name: str, before: Estimate[Problem], after: Estimate[Problem]) -> str:
    one, other = before[name], after[name]
    new = with_unit(with_error(other.value, other.standard_error), other.unit)
    return f"{name} changes from {with_error(one.value, one.standard_error)} to {new}"
