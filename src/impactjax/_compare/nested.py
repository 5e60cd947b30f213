"""Nested models: special cases of a model, and searches that start from their results."""

import math
from collections.abc import Callable, Mapping

import numpy as np
from jaxtyping import Float

from impactjax._compare.oscillators import DRY_FRICTION, is_dry
from impactjax._fit.estimate import Estimate
from impactjax._model.hertz import Hertz
from impactjax._model.hertz_dashpot import HertzDashpot
from impactjax._model.hunt_crossley import HuntCrossley
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.kelvin_voigt import KelvinVoigt
from impactjax._model.kelvin_voigt_linear_restitution import KelvinVoigtLinearRestitution
from impactjax._model.law import AbstractForceLaw
from impactjax._model.linear_restitution import LinearRestitution
from impactjax._model.power_law import PowerLaw
from impactjax._model.power_restitution import PowerRestitution
from impactjax._model.pust_peterka import PustPeterka
from impactjax._model.restitution import Restitution
from impactjax._model.simon import Simon
from impactjax._model.stop import Stop
from impactjax._model.walton import Walton
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem

_SAME = 1e-9  # relative difference of fixed values that count as equal

Values = Mapping[str, float]
Case = Callable[[Values], Values | None]


def _as_line(at: Values) -> Values:
    return {"r0": at["r"], "alpha": 0.0}


def _elastic(at: Values) -> Values:
    return {"k": at["k"], "c": 0.0, "alpha": 0.0, "n": 1.5}


def _contact_line(at: Values) -> Values | None:
    gamma = at["gamma"]
    if gamma >= 1:
        return None  # no restitution
    return {"r0": math.exp(-math.pi * gamma / math.sqrt(1 - gamma**2)), "alpha": 0.0}


def _powers(n: float, p: float, q: float) -> Callable[[Values], Values | None]:
    return lambda _: {"n": n, "p": p, "q": q}


SPECIAL_CASES: dict[tuple[type, type], Callable[[Values], Values | None]] = {
    (Restitution, LinearRestitution): _as_line,
    (Restitution, PowerRestitution): _as_line,
    (KelvinVoigt, KelvinVoigtLinearRestitution): _contact_line,
    (Hertz, Simon): _elastic,
    (Hertz, HuntCrossley): _elastic,
    (Hertz, PustPeterka): _elastic,
    (Hertz, HertzDashpot): _elastic,
    (Hertz, PowerLaw): _elastic,
    (Simon, HuntCrossley): lambda _: {"n": 1.5},
    (Simon, PustPeterka): lambda at: {"alpha": at["c"], "q": 1.0},
    (Simon, PowerLaw): lambda at: {"c": at["k"] * at["c"], "n": 1.5, "p": 1.5, "q": 1.0},
    (Walton, HuntCrossley): lambda at: {"c": at["c"] / at["k"], "n": 1.0},
    (Walton, PowerLaw): _powers(1.0, 1.0, 1.0),
    (HuntCrossley, PowerLaw): lambda at: {"c": at["k"] * at["c"], "p": at["n"], "q": 1.0},
    (PustPeterka, PowerLaw): lambda at: {"c": at["k"] * at["alpha"], "n": 1.5, "p": 1.5},
    (HertzDashpot, PowerLaw): _powers(1.5, 0.0, 1.0),
    (KelvinVoigt, PowerLaw): lambda at: {
        "k": at["mass"] * at["omega0"] ** 2,
        "c": 2 * at["mass"] * at["gamma"] * at["omega0"],
        "n": 1.0,
        "p": 0.0,
        "q": 1.0,
    },
}
"""For a smaller and a larger law: function from the smaller one's parameters to those of the larger
one with which it is the same law; parameters that are not returned have the same value."""


def special_values(large: ImpactOscillator, small: ImpactOscillator) -> Case | None:
    """Function from the smaller model's parameters to those of the larger one with which both are
    equal; `None` if the smaller one is no special case. Fixed parameters are not considered.
    """
    if type(large.oscillator) is not type(small.oscillator) or large.upper or small.upper:
        return None
    if _same_kind(large.lower, small.lower):
        more = is_dry(large.oscillator) and not is_dry(small.oscillator)
        return (lambda _: {DRY_FRICTION: 0.0}) if more else None
    if large.lower is None or small.lower is None:
        return None
    if is_dry(large.oscillator) != is_dry(small.oscillator):
        return None
    if _separation(large.lower) is not _separation(small.lower):
        return None
    return SPECIAL_CASES.get((type(small.lower.law), type(large.lower.law)))


def _same_kind(one: Stop | None, other: Stop | None) -> bool:
    if one is None or other is None:
        return one is other
    return type(one.law) is type(other.law)


def _separation(stop: Stop) -> type | None:
    return type(stop.law.separation) if isinstance(stop.law, AbstractForceLaw) else None


def in_stages(models: Mapping[str, ImpactOscillator]) -> list[list[str]]:
    """The names of models in groups, each group after those with its special cases."""
    left, stages = dict(models), []
    while left:
        stage = [
            name
            for name, model in left.items()
            if not any(special_values(model, small) for small in left.values())
        ]
        stages.append(stage)
        left = {name: model for name, model in left.items() if name not in stage}
    return stages


def special_case(
    problem: Problem, estimate: Estimate[Problem]
) -> Float[np.ndarray, " parameters"] | None:
    """The values of a problem's parameters with which its model equals a fitted smaller one.

    `None` if that is no special case, or if a parameter is fixed at another value.
    """
    case = special_values(problem.system.model, estimate.problem.system.model)
    if case is None:
        return None
    at = {name: float(each.get(estimate.system)) for name, each in handles(estimate.system).items()}
    own = {name: float(each.get(problem.system)) for name, each in handles(problem.system).items()}
    special = case(at)
    if special is None:
        return None
    wanted = own | at | dict(special)
    fixed = own.keys() - {*problem.names}
    if not all(math.isclose(wanted[name], own[name], rel_tol=_SAME) for name in fixed):
        return None
    return np.array([wanted[name] for name in problem.names])
