"""Numbers of performances and their certificate, against all plans of a small budget."""

import itertools
import math

import numpy as np
import pytest

import impactjax as ij
from impactjax._design.allocation import Task, best_numbers
from impactjax._design.certificate import least_loss, least_price
from impactjax._design.criterion import half_widths
from tiers import quick

pytestmark = quick

MOST = 6  # performances
CRITERIA = [ij.DOptimal(), ij.AOptimal(), ij.WorstParameter()]


def task(
    criterion: ij.AbstractCriterion, seed: int, costs: np.ndarray | None = None, models: int = 2
) -> Task:
    """Five candidates, each of which tells one or two of three parameters."""
    random = np.random.default_rng(seed)
    rows = random.normal(size=(5, models, 2, 3)) * random.uniform(1, 10, size=(5, 1, 1, 3))
    matrices = rows.swapaxes(-1, -2) @ rows
    price = np.ones(5) if costs is None else costs
    share = (price / MOST)[:, None]
    return Task(criterion, matrices, np.zeros((models, 3, 3)), share, price, np.arange(3))


def plans() -> np.ndarray:
    """All plans of up to six performances of five candidates."""
    every = itertools.product(range(MOST + 1), repeat=5)
    return np.array([plan for plan in every if sum(plan) <= MOST])


def losses(task: Task, every: np.ndarray) -> np.ndarray:
    """The criterion of some plans, by its definition with `inv` and `det` of each matrix."""
    found = []
    for plan in every:
        matrices = [
            sum(n * m for n, m in zip(plan, task.matrices[:, i], strict=True)) for i in (0, 1)
        ]
        inverses = [np.linalg.inv(m + 1e-8 * np.eye(3)) for m in matrices]
        if isinstance(task.criterion, ij.DOptimal):
            found.append(np.mean([np.log(np.linalg.det(c)) / 3 for c in inverses]))
        elif isinstance(task.criterion, ij.AOptimal):
            found.append(np.mean([np.trace(c) / 3 for c in inverses]))
        elif isinstance(task.criterion, ij.WorstParameter):
            found.append(np.mean([np.diag(c).max() for c in inverses]))
        else:
            assert isinstance(task.criterion, ij.Within)
            asked = np.array([width for _, width in task.criterion.asked])
            found.append(max((np.diag(c) * (1.959964 / asked) ** 2).max() for c in inverses))
    return np.array(found)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda each: type(each).__name__)
def test_numbers_are_nearly_the_best_of_all_plans(criterion, seed):
    own = task(criterion, seed)
    every = plans()
    best = losses(own, every).min()
    found = losses(own, best_numbers(own)[None])[0]
    assert best <= found + 1e-9
    assert criterion.size(found) <= 1.02 * criterion.size(best)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda each: type(each).__name__)
def test_no_plan_is_below_the_certificate(criterion, seed):
    own, every = task(criterion, seed), plans()
    numbers = best_numbers(own)
    least, best = least_loss(own, numbers), losses(own, every).min()
    assert least <= best + 1e-9
    if isinstance(criterion, ij.DOptimal):
        assert criterion.size(least) > 0.9 * criterion.size(best)


@pytest.mark.parametrize("seed", range(3))
def test_goal_is_reached_at_nearly_the_lowest_price(seed):
    costs = np.array([1.0, 2.0, 0.5, 1.0, 1.5])
    wide = task(ij.Within({"a": 1.0, "b": 1.0, "c": 1.0}), seed, costs)
    every = plans()
    values = losses(wide, every)
    possible = (every @ costs <= MOST) & (every.sum(axis=1) > 3)
    width = math.sqrt(np.quantile(values[possible], 0.3))
    own = wide._replace(criterion=ij.Within(dict.fromkeys("abc", width)))
    prices = every @ costs
    reaching = (values <= width**2) & possible
    found = best_numbers(own)
    assert own.criterion.loss(own.covariances(own.total(found))) <= 1
    assert found @ costs <= 1.35 * prices[reaching].min()
    assert least_price(own, found) <= prices[values <= width**2].min() + 1e-9


@pytest.mark.parametrize(
    "criterion",
    [*CRITERIA, ij.Within({"a": 0.1, "b": 0.2, "c": 0.3})],
    ids=lambda each: type(each).__name__,
)
def test_slope_of_a_criterion_is_its_derivative(criterion):
    random = np.random.default_rng(0)
    rows = random.normal(size=(2, 5, 3))
    at, along = rows.swapaxes(-1, -2) @ rows, random.normal(size=(2, 3, 3))
    along = along + along.swapaxes(-1, -2)
    step = 1e-6
    change = (criterion.loss(at + step * along) - criterion.loss(at - step * along)) / (2 * step)
    slope = np.sum(criterion.slope(at) * along.swapaxes(-1, -2))
    np.testing.assert_allclose(slope, change, rtol=1e-6)


def test_d_optimal_plan_halves_its_performances_between_two_lines():
    """Two candidates that tell one parameter each are performed equally often, whatever their
    precision; under the A-criterion in the ratio of their errors.
    """
    matrices = np.array([np.diag([1.0, 0.0]), np.diag([0.0, 9.0])])[:, None]
    nothing, own = np.zeros((1, 2, 2)), np.arange(2)
    shares, price = np.full((2, 1), 1 / 40), np.ones(2)
    d = Task(ij.DOptimal(), matrices, nothing, shares, price, own)
    assert best_numbers(d).tolist() == [20, 20]
    a = Task(ij.AOptimal(), matrices, nothing, shares, price, own)
    assert best_numbers(a).tolist() == [30, 10]
    np.testing.assert_allclose(least_loss(a, best_numbers(a)), (1 / 30 + 1 / 90) / 2, rtol=1e-6)


def test_half_width_of_a_normal_interval():
    np.testing.assert_allclose(half_widths(np.array(0.5)), 0.979982, rtol=1e-6)


def test_wrong_criteria_are_refused():
    with pytest.raises(ValueError, match="at least one parameter"):
        ij.Within({})
    with pytest.raises(ValueError, match="`k` must be positive, but is"):
        ij.Within({"k": -0.1})
    with pytest.raises(ValueError, match="must rise"):
        ij.Between(1.0, 1.0)
    with pytest.raises(ValueError, match="`speed` needs a range"):
        ij.Candidates(lambda model, speed: model, {"speed": []})
