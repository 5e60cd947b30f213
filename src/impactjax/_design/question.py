"""The question of a design: candidates, information that exists, criterion and budget."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from impactjax._design.allocation import Task
from impactjax._design.candidates import PERFORMANCES, Candidates
from impactjax._design.criterion import AbstractCriterion
from impactjax._design.informed import Informed, Matrices
from impactjax._design.refine import Chosen
from impactjax._known import AnyArray
from impactjax._refusal import check_kind


@dataclasses.dataclass(frozen=True)
class Question:
    """The question of a design.

    - `informed`: information in each candidate.
    - `criterion`, `budget`: criterion, and what there is of each resource.
    - `before`: information that exists already.
    - `resource`: what is to be saved at a goal without a budget.
    """

    informed: Informed
    criterion: AbstractCriterion
    budget: Mapping[str, float]
    before: Matrices
    resource: str

    @property
    def own(self) -> Int[AnyArray, " own"]:
        """Indices of the parameters that count."""
        names = self.informed.names
        return np.array([names.index(each) for each in self.criterion.parameters(names)], int)

    def check(self) -> None:
        """Raises `ValueError` for unknown parameters, and for a goal for a parameter at zero."""
        names = self.informed.names
        for name in self.criterion.parameters(names):
            if name not in names:
                raise ValueError(f"There is no parameter `{name}`; there are {', '.join(names)}.")
            values = [each[name] for each in self.informed.values]
            if self.criterion.asked_widths() and 0.0 in values:
                raise ValueError(f"`{name}` is zero, so that no interval is relative to it.")

    def task(self, points: Sequence[Chosen]) -> Task:
        """The choice of numbers of performances at some points."""
        matrices = [self.informed.of(each.candidates, each.values) for each in points]
        return Task(
            self.criterion,
            np.array(matrices),
            self.before,
            np.array([self._relative(each) for each in points]),
            np.array([self._price(each) for each in points]),
            self.own,
        )

    def loss(self, plan: Sequence[Chosen]) -> float:
        """The loss of a plan."""
        task = self.task(plan)
        total = task.total(np.array([each.number for each in plan]))
        return float(self.criterion.loss(task.covariances(total)))

    def price(self, plan: Sequence[Chosen]) -> float:
        """The price of a plan, by which plans that reach a goal are compared."""
        return sum(each.number * self._price(each) for each in plan)

    def left(self, plan: Sequence[Chosen]) -> Float[AnyArray, " resources"]:
        """The shares of the budget that a plan does not take."""
        taken = [each.number * self._relative(each) for each in plan]
        return 1 - sum(taken, np.zeros(len(self.budget)))

    def left_at_goal(self, plan: Sequence[Chosen]) -> Float[AnyArray, " limits"]:
        """The same, and the relative distance of the loss from its goal."""
        return np.append(self.left(plan), 1 - self.loss(plan) / self.criterion.goal)

    def reached(self, plan: Sequence[Chosen]) -> bool:
        """True if there is a goal, and a plan reaches it."""
        return self.criterion.goal > -np.inf and self.loss(plan) <= self.criterion.goal

    def _relative(self, point: Chosen) -> Float[AnyArray, " resources"]:
        own = point.candidates.costs(point.values)
        return np.array([own.get(name, 0.0) / most for name, most in self.budget.items()])

    def _price(self, point: Chosen) -> float:
        """The shares of the budget together; without a budget, what is to be saved."""
        if self.budget:
            return float(self._relative(point).sum())
        return point.candidates.costs(point.values).get(self.resource, 0.0)


def resource_of(candidates: Sequence[Candidates], budget: Mapping[str, float]) -> str:
    """The resource to save at a goal without a budget: the only one that candidates name, or the
    number of performances.

    **Raises** `ValueError` for an unknown resource in the budget, one of which there is nothing,
    and for several resources of which none has a budget.
    """
    check_kind("budget", budget, Mapping, "{'performances': 5}")
    first = [(each, each.points()[0]) for each in candidates]
    known = dict.fromkeys(name for each, point in first for name in each.costs(point))
    for name, most in budget.items():
        if name not in known:
            raise ValueError(f"The budget names `{name}`, which no candidate takes.")
        if not isinstance(most, int | float) or not most > 0:
            raise ValueError(f"The budget of `{name}` must be positive, but it is {most}.")
    named = [name for name in known if name != PERFORMANCES]
    if not budget and len(named) > 1:
        raise ValueError(
            f"State a budget of {', '.join(named)}: without one they cannot be weighed."
        )
    return named[0] if named else PERFORMANCES
