"""Limit of what any plan of some candidates can reach.

A convex function of the information lies above its tangent. The lowest value of the tangent over
all plans within the budgets, with fractions of performances allowed, is a linear programme.

Source: J. Kiefer and J. Wolfowitz (1960), "The equivalence of two extremum problems", Canadian
Journal of Mathematics 12, 363; the bound is the duality gap of Frank and Wolfe's method.
"""

import math

import numpy as np
from jaxtyping import Float

from impactjax._design.allocation import Numbers, Task, covariances
from impactjax._known import AnyArray


def least_loss(task: Task, numbers: Numbers) -> float:
    """A loss that no plan within the budgets falls below."""
    from scipy import optimize

    loss, gains, own = _tangent(task, numbers)
    if not np.isfinite(task.costs).all():
        return -math.inf
    found = optimize.linprog(
        -gains, A_ub=task.costs.T, b_ub=np.ones(task.costs.shape[1]), bounds=(0, None)
    )
    return loss - (-float(found.fun) - own) if found.success else -math.inf


def least_price(task: Task, numbers: Numbers) -> float:
    """A price that every plan that reaches the goal has at least. The tangent is that at the plan's
    part that just reaches it.
    """
    from scipy import optimize

    def excess(share: float) -> float:
        total = task.total(share * numbers)
        return float(task.criterion.loss(task.covariances(total))) - task.criterion.goal

    share = 1.0 if excess(0.0) <= 0 or excess(1.0) >= 0 else optimize.brentq(excess, 0.0, 1.0)
    loss, gains, own = _tangent(task, share * numbers)
    needed = own - (task.criterion.goal - loss)
    found = optimize.linprog(task.price, A_ub=-gains[None], b_ub=[-needed], bounds=(0, None))
    return float(found.fun) if found.success else 0.0


def _tangent(task: Task, numbers: Numbers) -> tuple[float, Float[AnyArray, " candidates"], float]:
    """The loss of a plan, its decrease by one performance of each candidate, to first order, and
    that by all performances of the plan.

    With the derivative W of the loss by the covariance C it is tr(C W C M) for the information M.
    """
    whole = covariances(task.total(numbers))
    own = task.covariances(task.total(numbers))
    columns = whole[..., task.own]
    slope = columns @ task.criterion.slope(own) @ columns.swapaxes(-1, -2)
    gains = np.einsum("mij,emji->e", slope, task.matrices)
    return float(task.criterion.loss(own)), gains, float(gains @ numbers)
