"""Laws that contain others as special cases, and where their searches start from those' answers."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from impactjax._compare.laws import NO_LAW
from impactjax._fit.estimate import Estimate
from impactjax._known import AnyArray
from impactjax._problem.parameters import handles
from impactjax._problem.problem import Problem

_SHARES = (0.0, 0.01, 0.1, 1.0)  # of the way to the first estimate of what the larger law adds
_SAME = 1e-9  # relative, of values that are fixed in both

Values = Mapping[str, float]
Variant = tuple[str, bool]  # a law's name, and whether there is dry friction


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


SPECIAL_CASES: dict[tuple[str, str], Callable[[Values], Values | None]] = {
    ("restitution", "linear-restitution"): _as_line,
    ("restitution", "power-restitution"): _as_line,
    ("kelvin-voigt", "kelvin-voigt-linear-restitution"): _contact_line,
    ("hertz", "simon"): _elastic,
    ("hertz", "hunt-crossley"): _elastic,
    ("hertz", "pust-peterka"): _elastic,
    ("hertz", "hertz-dashpot"): _elastic,
    ("hertz", "power-law"): _elastic,
    ("simon", "hunt-crossley"): lambda _: {"n": 1.5},
    ("simon", "pust-peterka"): lambda at: {"alpha": at["c"], "q": 1.0},
    ("simon", "power-law"): lambda at: {"c": at["k"] * at["c"], "n": 1.5, "p": 1.5, "q": 1.0},
    ("walton", "hunt-crossley"): lambda at: {"c": at["c"] / at["k"], "n": 1.0},
    ("walton", "power-law"): _powers(1.0, 1.0, 1.0),
    ("hunt-crossley", "power-law"): lambda at: {"c": at["k"] * at["c"], "p": at["n"], "q": 1.0},
    ("pust-peterka", "power-law"): lambda at: {"c": at["k"] * at["alpha"], "n": 1.5, "p": 1.5},
    ("hertz-dashpot", "power-law"): _powers(1.5, 0.0, 1.0),
    ("kelvin-voigt", "power-law"): lambda at: {
        "k": at["mass"] * at["omega0"] ** 2,
        "c": 2 * at["mass"] * at["gamma"] * at["omega0"],
        "n": 1.0,
        "p": 0.0,
        "q": 1.0,
    },
}
"""The larger law's parameters that follow from the smaller one's; the others are the same."""


def may_contain(large: Variant, small: Variant) -> bool:
    """Whether one model may be a special case of another: it is if what is fixed allows it."""
    if small[0] == large[0] == NO_LAW:
        return large[1] and not small[1]
    return small[1] == large[1] and (small[0], large[0]) in SPECIAL_CASES


def in_stages(variants: Sequence[Variant]) -> list[list[Variant]]:
    """The models in groups, each after those that hold special cases of its own."""
    left, stages = list(dict.fromkeys(variants)), []
    while left:
        stage = [each for each in left if not any(may_contain(each, small) for small in left)]
        stages.append(stage)
        left = [each for each in left if each not in stage]
    return stages


def special_case(
    large: Variant, problem: Problem, small: Variant, estimate: Estimate[Problem]
) -> Float[np.ndarray, " parameters"] | None:
    """The values of a problem's parameters with which it is the smaller model's answer; `None` if
    there are none, because something is fixed at another value.
    """
    if not may_contain(large, small):
        return None
    at = {name: float(each.get(estimate.system)) for name, each in handles(estimate.system).items()}
    own = {name: float(each.get(problem.system)) for name, each in handles(problem.system).items()}
    still: Values | None = {"dry_friction": 0.0}
    special = still if large[0] == NO_LAW else SPECIAL_CASES[small[0], large[0]](at)
    if special is None:
        return None
    wanted = own | at | dict(special)
    fixed = own.keys() - {*problem.names}
    if not all(math.isclose(wanted[name], own[name], rel_tol=_SAME) for name in fixed):
        return None
    return np.array([wanted[name] for name in problem.names])


def starts_beside(
    problem: Problem, cases: Sequence[np.ndarray], lanes: Float[AnyArray, "lanes parameters"]
) -> Float[AnyArray, "lanes parameters"]:
    """As many starts: the special cases themselves, and beside them towards the first start, since
    at the end of a range nothing is felt.
    """
    first = problem.values(np.asarray(lanes[0]))
    rows = [case + share * (first - case) for share in _SHARES for case in cases]
    rows = (rows * math.ceil(len(lanes) / len(rows)))[: len(lanes)]
    return problem.unbounded(np.stack(rows))
