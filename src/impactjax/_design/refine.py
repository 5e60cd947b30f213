"""Continuous choices of a plan, improved by gradient.

Source: D. Kraft (1988), "A software package for sequential quadratic programming", DFVLR-FB 88-28
(SciPy's SLSQP).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._design.candidates import Candidates, Values
from impactjax._known import AnyArray

Unit = Float[AnyArray, " ranges"]

_STEP = 1e-4  # of a central difference, relative to the range
_MOST = 40  # iterations
_TINY = 1e-9  # relative excess of a limit that counts as none


class Chosen(NamedTuple):
    """Performances at one point of the choices."""

    candidates: Candidates
    values: Values
    number: int

    @property
    def unit(self) -> Unit:
        """The continuous choices, each from 0 to 1."""
        ranges = self.candidates.ranges
        return np.array([(self.values[n] - r.low) / (r.high - r.low) for n, r in ranges.items()])

    def at(self, unit: Unit) -> "Chosen":
        """The same with other continuous choices."""
        ranges = self.candidates.ranges
        pairs = zip(ranges.items(), np.clip(unit, 0, 1).tolist(), strict=True)
        new = {name: r.low + (r.high - r.low) * x for (name, r), x in pairs}
        return self._replace(values={**self.values, **new})


def refined(
    plan: Sequence[Chosen],
    objective: Callable[[Sequence[Chosen]], float],
    room: Callable[[Sequence[Chosen]], Float[AnyArray, " limits"]],
) -> list[Chosen]:
    """A plan with continuous choices at which an objective is lower. The derivatives are central
    differences: they need no program but that of the information.

    **Arguments:**

    - `objective`: the loss or the price of a plan.
    - `room`: what is left up to each limit, such as a budget; not negative.
    """
    from scipy import optimize

    cuts = np.cumsum([len(each.unit) for each in plan])
    start = np.concatenate([np.zeros(0), *(each.unit for each in plan)])
    if not start.size:
        return list(plan)

    size = abs(objective(plan)) or 1.0  # the search ends at an absolute change

    def at(unit: Unit) -> list[Chosen]:
        parts = np.split(unit, cuts[:-1])
        return [each.at(part) for each, part in zip(plan, parts, strict=True)]

    def slopes(unit: Unit) -> Unit:
        found = []
        for step in _STEP * np.eye(len(unit)):
            ahead, behind = np.minimum(unit + step, 1), np.maximum(unit - step, 0)
            change = objective(at(ahead)) - objective(at(behind))
            found.append(change / (ahead - behind).sum() / size)
        return np.array(found)

    result = optimize.minimize(
        lambda unit: objective(at(unit)) / size,
        start,
        jac=slopes,
        bounds=[(0.0, 1.0)] * len(start),
        constraints={"type": "ineq", "fun": lambda unit: room(at(unit))},
        method="SLSQP",
        options={"maxiter": _MOST, "ftol": 1e-6},
    )
    better = at(result.x)
    inside = bool(np.all(room(better) >= -_TINY))
    return better if inside and objective(better) < objective(plan) else list(plan)
