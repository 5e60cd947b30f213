"""The verb `design`: which experiments to perform next."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import jax
import numpy as np

from impactjax._design.allocation import Numbers, Task, best_numbers, covariances
from impactjax._design.candidates import Candidates
from impactjax._design.certificate import least_loss, least_price
from impactjax._design.criterion import AbstractCriterion, half_widths, scale_of
from impactjax._design.informed import Informed, recordings
from impactjax._design.plan import Design, Expected, Performance
from impactjax._design.question import Question, resource_of
from impactjax._design.refine import Chosen, refined
from impactjax._design.refits import Refits, refitted
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._problem.experiment import Experiment
from impactjax._problem.prior import Normal
from impactjax._refusal import check_function, check_kind, whole

_ROUNDS = 4  # of numbers and continuous choices in turn
_UNKNOWN = 100.0  # relative error from which a parameter counts as not determined

Tell = Callable[[str], None]
T = TypeVar("T")


def design(
    candidates: Candidates | Sequence[Candidates],
    models: ImpactOscillator | Sequence[ImpactOscillator],
    criterion: AbstractCriterion,
    *,
    budget: Mapping[str, float] | None = None,
    performed: Sequence[Experiment] = (),
    priors: Mapping[str, Normal] | None = None,
    scatter: float = 0.0,
    refits: int = 100,
    seed: int = 0,
    tell: Tell = lambda _: None,
) -> Design:
    """The experiments to perform next: the plan with the smallest error within a budget, or the
    cheapest that reaches a goal.

    The choices are covered by points. Numbers of performances are found by additions, removals and
    exchanges; then the continuous choices of the plan are improved by gradient. This is repeated
    until neither helps. Information adds up over performances, each with its own initial state,
    release and sensor. The noise of a sensor is independent, and scatter of restitution adds to it.

    **Arguments:**

    - `candidates`: experiments of one kind or of several.
    - `models`: the model with the values around which to plan, or several that are thought equally
      likely; precision is then averaged over them, and a goal holds for all.
    - `criterion`: `DOptimal()`, `AOptimal()`, `WorstParameter()` or `Within({"k": 0.05})`.
    - `budget`: what there is of each resource that the candidates' `cost` names, and of
      "performances". It may be left out for a goal.
    - `performed`: experiments whose recordings exist already; their information counts.
    - `priors`: prior knowledge of parameters of the model.
    - `scatter`: standard deviation of the logarithm of the speed after each impact [1]; refits draw
      the factor of each impact, and find it with the parameters.
    - `refits`: number of simulated refits at the first model, which verify the expected precision.
    - `seed`: random seed of their noise.
    - `tell`: called with a few words before each stage.

    **Raises** `ValueError` as `information` does, without a budget for a criterion that has no
    goal, for unknown names of parameters or resources, if no candidate can be simulated, and for a
    goal for a parameter at zero.
    """
    kinds = _several(candidates, Candidates, "Candidates(drop, {'theta0': Between(0.2, 1.2)})")
    possible = _several(models, ImpactOscillator, "ImpactOscillator(Pendulum(13.0), Stop(...))")
    check_kind("criterion", criterion, AbstractCriterion, 'Within({"k": 0.05})')
    if criterion.goal == -math.inf and not budget:
        raise ValueError('State a budget, as in budget={"performances": 5}: more is always better.')
    check_kind("performed", performed, Sequence, "[experiment]")
    whole("refits", refits, 0)
    whole("seed", seed, 0)
    check_function("tell", tell)
    resource = resource_of(kinds, budget or {})
    points = [Chosen(each, values, 0) for each in kinds for values in each.points()]
    done = [Chosen(_again(each), {}, 1) for each in performed]
    informed = Informed(possible, _longest(possible[0], [*points, *done]), scatter)
    tell(f"information in {len(points)} candidates")
    informed.check_alike(points[0].candidates, points[0].values)
    good = [each for each in points if np.isfinite(informed.of(each.candidates, each.values)).all()]
    if not good:
        raise ValueError("None of the candidates can be simulated.")
    own = [informed.of(each.candidates, each.values) for each in done]
    before = sum(own, informed.of_priors(priors or {}))
    question = Question(informed, criterion, budget or {}, before, resource)
    question.check()
    plan, task, numbers = _best(question, good, tell)
    motions = [
        [informed.padded(one) for one in recordings(each.candidates, possible[0], each.values)]
        for each in [*done, *plan]
        for _ in range(each.number)
    ]
    found = None
    if refits and motions:
        tell(f"{refits} simulated refits")
        found = refitted(motions, priors or {}, jax.random.key(seed), refits, scatter)
    described = _described(question, plan, task, numbers, found)
    return dataclasses.replace(described, refits=refits, impossible=len(points) - len(good))


def _best(
    question: Question, points: list[Chosen], tell: Tell
) -> tuple[list[Chosen], Task, Numbers]:
    """The best plan found, with the points tried and the number of performances at each."""
    plan, task, numbers = _at_points(question, points, tell)
    for _ in range(_ROUNDS if plan else 0):
        tell("continuous choices")
        better = refined(plan, question.loss, question.left)
        if question.reached(plan):
            better += refined(plan, question.price, question.left_at_goal)
        old = [each.values for each in plan]
        new = [each._replace(number=0) for each in better if each.values not in old]
        if not new:
            break
        points = [*points, *new]
        plan, task, numbers = _at_points(question, points, tell)
    return plan, task, numbers


def _at_points(
    question: Question, points: list[Chosen], tell: Tell
) -> tuple[list[Chosen], Task, Numbers]:
    """The best plan of performances at some points."""
    tell(f"numbers of performances at {len(points)} points")
    task = question.task(points)
    numbers = best_numbers(task)
    pairs = zip(points, numbers, strict=True)
    return [each._replace(number=int(n)) for each, n in pairs if n > 0], task, numbers


def _described(
    question: Question, plan: list[Chosen], task: Task, numbers: Numbers, found: Refits | None
) -> Design:
    criterion, informed = question.criterion, question.informed
    loss = float(criterion.loss(task.covariances(task.total(numbers))))
    errors = np.sqrt(np.diagonal(covariances(task.total(numbers))[0]))
    expected = {}
    for name, error in zip(informed.names, errors, strict=True):
        value, width = informed.values[0][name], float(half_widths(error))
        known = width if error < _UNKNOWN else math.inf
        attained = math.nan if found is None else _attained(found, name, value)
        unit, positive = informed.units[name], informed.positive[name]
        expected[name] = Expected(name, value, unit, positive, known, attained)
    reached = criterion.goal > -math.inf and loss <= criterion.goal * (1 + 1e-9)
    price = float(numbers @ task.price)
    return Design(
        criterion=criterion,
        performances=tuple(
            Performance(each.candidates.name, dict(each.values), each.number, _costs([each]))
            for each in plan
        ),
        expected=expected,
        size=criterion.size(loss),
        least_size=_least_size(task, numbers),
        costs=_costs(plan),
        budget=dict(question.budget),
        least_share=least_price(task, numbers) / price if reached and price > 0 else math.nan,
        scatter=informed.scatter,
        refits=0,
        failed=0 if found is None else found.failed,
        impossible=0,
    )


def _least_size(task: Task, numbers: Numbers) -> float:
    """The smallest size that the candidates may have; 0 if nothing is known about it."""
    least = least_loss(task, numbers)
    if least == -math.inf or (least <= 0 and task.criterion.asked_widths()):
        return 0.0
    return task.criterion.size(least)


def _attained(found: Refits, name: str, value: float) -> float:
    """Half-width of an interval from the root mean square error of the refits."""
    if not len(found.values):
        return math.nan
    errors = found.values[:, found.names.index(name)] - value
    return float(half_widths(np.sqrt(np.mean(errors**2)))) / scale_of(value)


def _costs(plan: Sequence[Chosen]) -> dict[str, float]:
    total: dict[str, float] = {}
    for each in plan:
        for name, one in each.candidates.costs(each.values).items():
            total[name] = total.get(name, 0.0) + each.number * one
    return total


def _again(experiment: Experiment) -> Candidates:
    """Candidates of one experiment, at other values of its model."""
    check_kind("performed", experiment, Experiment, "Experiment(model, recording, initial)")
    return Candidates(lambda model: dataclasses.replace(experiment, model=model))


def _longest(model: ImpactOscillator, points: Sequence[Chosen]) -> int:
    """The largest number of observations in a recording."""
    return max(
        one.recording.valid.shape[-1]
        for each in points
        for one in recordings(each.candidates, model, each.values)
    )


def _several(given: T | Sequence[T], kind: type[T], example: str) -> tuple[T, ...]:
    argument = "candidates" if kind is Candidates else "models"
    if not isinstance(given, Sequence):
        check_kind(argument, given, kind, example)
    several = tuple(given) if isinstance(given, Sequence) else (given,)
    for each in several:
        check_kind(argument, each, kind, example)
    if not several:
        raise ValueError(f"Give at least one: {example}.")
    return several
