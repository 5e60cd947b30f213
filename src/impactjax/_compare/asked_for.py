"""Parameters that the record asks for, because the best of several fits left them out."""

import dataclasses
import math
from collections.abc import Sequence

import equinox as eqx
import numpy as np

from impactjax._compare.oscillators import with_dry_friction
from impactjax._compare.ranking import fall
from impactjax._fit.estimate import Estimate
from impactjax._fit.left_out import Undecided, needed, not_excluded
from impactjax._fit.score_test import HeldParameter
from impactjax._fit.search import Search
from impactjax._number_format import with_error, with_unit
from impactjax._problem.experiment import Experiment
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem
from impactjax._sensor.low_pass import Butterworth

_MOVED = 1.0  # change of a value, in standard errors, that is worth a word


def asked_for(
    estimate: Estimate[Problem], experiment: Experiment, search: Search
) -> list[HeldParameter]:
    """The parameters that the record asks for beside those fitted and those stated by the user. A
    sensor without a low-pass states that there is none.
    """
    if not bool(estimate.converged):
        return []
    return needed(estimate, _stated(experiment), search)


def slightly_asked_for(
    estimate: Estimate[Problem], experiment: Experiment, search: Search
) -> list[Undecided]:
    """The parameters of which the record does not tell whether they are needed beside those fitted
    and those stated by the user.
    """
    return not_excluded(estimate, _stated(experiment), search)


def _stated(experiment: Experiment) -> tuple[str, ...]:
    """Names of the parameters that the user stated."""
    absent = () if experiment.sensor.low_pass is not None else ("cutoff",)
    return (*experiment.fixed, *absent)


def freed(experiment: Experiment, problem: Problem, found: Sequence[HeldParameter]) -> Experiment:
    """The experiment with more parameters to fit, those that its model has."""
    known = handles(problem.system)
    names = [each.name for each in found if each.name in known]
    free = tuple(dict.fromkeys([*experiment.free, *names]))
    return dataclasses.replace(experiment, free=free)


def rubbed(experiment: Experiment) -> Experiment:
    """The experiment with dry friction."""
    dry = with_dry_friction(experiment.model.oscillator)
    return eqx.tree_at(lambda each: each.model.oscillator, experiment, dry)


def behind(experiment: Experiment, low_pass: Butterworth) -> Experiment:
    """The experiment with a low-pass, whose cutoff is fitted."""
    sensor = dataclasses.replace(experiment.sensor, low_pass=low_pass)
    return dataclasses.replace(experiment, sensor=sensor, free=(*experiment.free, "cutoff"))


def newly_fitted(name: str, before: Estimate[Problem], after: Estimate[Problem]) -> HeldParameter:
    """A parameter that a model did not have, from a fit without and one with it."""
    own, gain = after[name], fall(before, after)
    return HeldParameter(name, own.unit, math.inf, own.value, own.standard_error, gain)


def values_before(problem: Problem, estimate: Estimate[Problem]) -> np.ndarray:
    """The values of a problem's parameters at an estimate with fewer of them."""
    own, before = handles(problem.system), handles(estimate.system)
    each = {name: handle.get(problem.system) for name, handle in own.items()}
    each |= {name: handle.get(estimate.system) for name, handle in before.items() if name in each}
    return np.array([float(each[name]) for name in problem.names])


def words(
    found: Sequence[HeldParameter], before: Estimate[Problem], after: Estimate[Problem]
) -> str:
    """The sentence on what was fitted as well, by how much it matters, and with what effect."""
    named = [_named(each, after) for each in found if each.name in after.names]
    gain = fall(before, after)
    moved = [
        _moved(name, before, after) for name in before.names if _has_moved(name, before, after)
    ]
    effect = f" {'; '.join(moved)}." if moved else " No other value changes by its standard error."
    return f"The record asks for {' and '.join(named)}: AIC falls by {gain:.0f}.{effect}"


def undecided(held: HeldParameter) -> str:
    """The sentence on a parameter of which the record does not tell whether it is needed."""
    return (
        f"Whether there is {held.name.replace('_', ' ')} is not decided: with it AIC falls by "
        f"{held.gain:.0f} only. The best model is given with and without it."
    )


def _named(held: HeldParameter, after: Estimate[Problem]) -> str:
    own = after[held.name]
    shown = with_unit(with_error(own.value, own.standard_error), own.unit)
    return f"`{held.name}` = {shown} instead of {held.instead}"


def _has_moved(name: str, before: Estimate[Problem], after: Estimate[Problem]) -> bool:
    error = before[name].standard_error
    return bool(abs(after[name].value - before[name].value) > _MOVED * error)


def _moved(name: str, before: Estimate[Problem], after: Estimate[Problem]) -> str:
    one, other = before[name], after[name]
    new = with_unit(with_error(other.value, other.standard_error), other.unit)
    return f"{name} changes from {with_error(one.value, one.standard_error)} to {new}"
