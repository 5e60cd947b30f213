"""Numbers of performances of candidates, by additions, removals and exchanges.

Source: V. V. Fedorov (1972), "Theory of optimal experiments", Academic Press (exchanges);
L. Pronzato and A. Pázman (2013), "Design of experiments in nonlinear models", Springer, chapter 9.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Num

from impactjax._design.criterion import AbstractCriterion, Covariances, Losses
from impactjax._known import AnyArray

Numbers = Num[AnyArray, " candidates"]

MOST = 1000  # performances
_TINY = 1e-9  # relative improvement that counts as none
_NOTHING = 1e-8  # information about a parameter of which nothing is known: an error of 10⁴


class Task(NamedTuple):
    """Candidates, of which some are to be performed.

    - `matrices`: information in one performance of each.
    - `before`: information that exists already.
    - `costs`: what one performance takes of each resource, relative to its budget.
    - `price`: what one performance takes of all resources, to compare plans that reach a goal.
    - `own`: indices of the parameters that count.
    """

    criterion: AbstractCriterion
    matrices: Float[AnyArray, "candidates models p p"]
    before: Float[AnyArray, "models p p"]
    costs: Float[AnyArray, "candidates resources"]
    price: Float[AnyArray, " candidates"]
    own: Int[AnyArray, " own"]

    def covariances(self, totals: Float[AnyArray, "... models p p"]) -> Covariances:
        """Covariances of the parameters that count."""
        return covariances(totals)[..., self.own[:, None], self.own]

    def losses(self, totals: Float[AnyArray, "... models p p"]) -> Losses:
        """The loss, or the goal where that is reached."""
        return np.maximum(self.criterion.loss(self.covariances(totals)), self.criterion.goal)

    def total(self, numbers: Numbers) -> Float[AnyArray, "models p p"]:
        """Information in a plan."""
        return self.before + np.tensordot(numbers, self.matrices, 1)


def covariances(
    totals: Float[AnyArray, "... p p"],
) -> Float[AnyArray, "... p p"]:
    """Covariances of relative errors; of errors of about 10⁴ where nothing is known."""
    return np.linalg.inv(totals + _NOTHING * np.eye(totals.shape[-1]))


def best_numbers(task: Task) -> Numbers:
    """The best numbers of performances found within the budgets: the lowest loss, and the lowest
    price that reaches a goal. One search begins with nothing, the others with each candidate alone.
    """
    nothing = np.zeros(len(task.matrices), int)
    begun = [_filled(task, nothing), *_alone(task)]
    ended = [_exchanged(task, numbers) for numbers in begun]
    return min(ended, key=lambda numbers: _rank(task, numbers))


def _rank(task: Task, numbers: Numbers) -> tuple[float, float]:
    loss = float(task.losses(task.total(numbers)))
    return (float(f"{loss:.9g}"), float(numbers @ task.price))


def _alone(task: Task) -> list[Numbers]:
    """The plans of one candidate only, the two best."""
    plans = []
    for i in range(len(task.matrices)):
        only = np.arange(len(task.matrices)) == i
        plans.append(_filled(task, np.zeros(len(only), int), only))
    return sorted(plans, key=lambda numbers: _rank(task, numbers))[:2]


def _filled(task: Task, numbers: Numbers, allowed: np.ndarray | None = None) -> Numbers:
    """A plan to which the candidate with the largest gain for its price is added, until the budget
    is used or the goal reached.
    """
    allowed = np.ones(len(numbers), bool) if allowed is None else allowed
    while numbers.sum() < MOST:
        total = task.total(numbers)
        now, then = task.losses(total), task.losses(total + task.matrices)
        gain = (now - then) / np.maximum(task.price, 1e-12)
        affordable = ((numbers @ task.costs + task.costs) <= 1 + _TINY).all(axis=1)
        possible = affordable & allowed & (then < now - _TINY * np.abs(now))
        if not possible.any():
            break
        numbers = numbers + (np.arange(len(numbers)) == np.argmax(np.where(possible, gain, -1)))
    return numbers


def _exchanged(task: Task, numbers: Numbers) -> Numbers:
    """A plan improved by single removals, additions and exchanges, as long as one helps: a lower
    loss, or a lower price at the goal, or there a lower loss at no higher price.
    """
    for _ in range(10 * MOST):
        moves = _moves(numbers)
        inside = ((numbers + moves) @ task.costs <= 1 + _TINY).all(axis=1)
        moves = moves[inside & ((numbers + moves).sum(axis=1) <= MOST)]
        total, price = task.total(numbers), moves @ task.price
        own = task.criterion.loss(task.covariances(total))
        then = task.criterion.loss(task.covariances(total + np.tensordot(moves, task.matrices, 1)))
        no_more = (price < _TINY) & (moves.sum(axis=1) <= 0)
        goal, less = task.criterion.goal, own - _TINY * np.abs(own)
        helps = np.where(own > goal, then < less, then <= goal) & (
            (own > goal) | (price < -_TINY) | (no_more & (then < less))
        )
        if not helps.any():
            break
        rank = then if own > goal else price + _TINY * then
        numbers = numbers + moves[np.argmin(np.where(helps, rank, np.inf))]
    return numbers


def _moves(numbers: Numbers) -> Int[AnyArray, "moves candidates"]:
    one = np.eye(len(numbers), dtype=int)
    less = -one[numbers > 0]
    exchanges = (less[:, None, :] + one).reshape(-1, len(numbers))
    return np.concatenate([less, one, exchanges])
