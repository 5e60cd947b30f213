"""Choices by name: laws, oscillators, rules of separation, equilibria and losses."""

import difflib
from collections.abc import Callable, Collection

from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.typical_systems import Law
from impactjax._model.equilibrium import AbstractEquilibrium, Hanging, Inverted
from impactjax._model.law import AbstractLaw
from impactjax._model.separation import AbstractSeparation, AtZeroForce, AtZeroPenetration
from impactjax._problem.loss import AbstractLoss, Cauchy, SoftL1, Squares, StudentT

SEPARATIONS: dict[str, AbstractSeparation] = {
    "zero-penetration": AtZeroPenetration(),
    "zero-force": AtZeroForce(),
}
EQUILIBRIA: dict[str, AbstractEquilibrium] = {"hanging": Hanging(), "inverted": Inverted()}
LOSSES: dict[str, Callable[[float], AbstractLoss]] = {
    "squares": lambda _: Squares(),
    "soft-l1": SoftL1,
    "cauchy": Cauchy,
    "student-t": StudentT,
}
"""Losses as functions of their scale."""


def check_named(kind: str, name: str, known: Collection[str]) -> None:
    """Raises `ValueError` for a name that is not known; the error suggests a similar one."""
    if name in known:
        return
    close = difflib.get_close_matches(name, known, 1)
    remedy = f"did you mean `{close[0]}`?" if close else f"there are {', '.join(known)}."
    raise ValueError(f"There is no {kind} `{name}`; {remedy}")


def check_law(law: Law) -> None:
    """Raises `ValueError` for a name that is not in the table, `TypeError` for another type."""
    if isinstance(law, str):
        check_named("law", law, [NO_LAW, *LAWS])
    elif not isinstance(law, AbstractLaw):
        raise TypeError(
            f"A law must be a name or an object such as `Restitution(0.7)`, but it is {law!r}."
        )


def check_oscillator(name: str) -> None:
    """Raises `ValueError` for the name of an oscillator that does not exist."""
    check_named("system", name, OSCILLATORS)
