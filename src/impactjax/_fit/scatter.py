"""Restitution that scatters from impact to impact: the fit of its size and of the mean law.

The speed after impact i is that of the law times exp(s ξᵢ), with standard normal ξᵢ. Around a point
(p, u) with uᵢ = s ξᵢ the residuals are linear in both, which is a linear mixed model. Its solution
is the next point, or a point on the way to it that lowers

    Σ residual²/σ² + Σ uᵢ²/s² + Σ ((p − mean)/sigma)² over the priors.

Source: M. J. Lindstrom and D. M. Bates (1990), "Nonlinear mixed effects models for repeated
measures data", Biometrics 46, 673, for the alternation of both steps.
"""

import dataclasses
import functools

import jax
import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import Evaluate
from impactjax._fit.linear_scatter import (
    Around,
    Effects,
    Mask,
    Step,
    Vector,
    around,
    counted,
    residuals_at,
    step_from,
)
from impactjax._fit.scatter_summary import Solution, likelier, summarised
from impactjax._fit.search import Search
from impactjax._fit.straight import straight
from impactjax._known import AnyArray, is_known, known, namespace
from impactjax._problem.padding import padded_size
from impactjax._problem.problem import Problem
from impactjax._record.abstract_recording import Residuals

_ROUNDS = 4  # linearisations under `jit`
_MOST = 24  # linearisations of known numbers
_SHARES = (1.0, 0.5, 0.2, 0.05, 0.01)  # of a step, tried in turn
_SETTLED = 1e-4  # share of its error that no value moves any more
_SLACK = 1.0  # rise of that sum that is allowed: a step averages over sizes of scatter and noise
_NO_EFFECT = 0.5  # distance from no effect, in errors, at which a parameter that fades is held


@np.errstate(all="ignore")  # no warnings, as in JAX
def with_scatter(estimate: Estimate[Problem], search: Search = Search()) -> Estimate[Problem]:
    """The estimate with scatter from impact to impact, from one without.

    Works under `jit` and `vmap`. It has converged if the one without scatter had, if a further
    linearisation would move no value by more than a tenth of its error, or by more than rounding,
    and if every impact has a factor.

    Parameters that fade, such as a cutoff, are also started from no effect. The likelier result is
    taken; if the record does not tell which one is right, the intervals hold both.
    """
    own = estimate.problem
    traced = not is_known((own, estimate.values))
    if not traced and not bool(estimate.converged):
        return estimate
    problem = own if traced else own.padded()
    axes = straight(problem)
    values = axes.places(estimate.values if traced else known(estimate.values))
    errors = estimate.standard_errors if traced else known(estimate.standard_errors)
    held = held_parameters(problem, values, errors)
    logs = namespace(values).zeros(affected(problem, estimate), values.dtype)
    longer = dataclasses.replace(estimate, problem=problem, scatter=None)
    if traced:
        solution = _iterated_in_a_loop(problem, values, logs, held, search.evaluate)
        return summarised(longer, solution).of(own)
    fades, starts = np.array(axes.fades), [(values, held)]
    nothing = np.where(fades, [each.low for each in axes.ranges], values)
    if np.any(nothing != values):
        starts.append((nothing, held | fades))
    solutions = [_iterated(problem, at, logs, on, search.evaluate) for at, on in starts]
    found = [summarised(longer, each) for each in solutions if each is not None]
    return functools.reduce(likelier, found).of(own) if found else estimate


def _iterated(
    problem: Problem, values: Vector, logs: Effects, held: Mask, evaluate: Evaluate
) -> Solution | None:
    """The point at which steps end: no further one moves anything, or is possible. `None` if there
    is no motion at the start.
    """
    point = around(problem, values, logs, evaluate)
    if not point.exists():
        return None
    step = step_from(problem, point.without(held), values, logs)
    for _ in range(_MOST):
        if _is_small(step, logs):
            break
        moved = _moved(problem, evaluate, point, values, logs, step)
        if moved is None:
            break
        values, logs, point = moved
        step = step_from(problem, point.without(held), values, logs)
    return Solution(values, logs, point, step, held)


def _iterated_in_a_loop(
    problem: Problem, values: Vector, logs: Effects, held: Mask, evaluate: Evaluate
) -> Solution:
    """The point after some whole steps, for traced numbers."""

    def linearised(values: Vector, logs: Effects) -> tuple[Around, Step]:
        point = around(problem, values, logs, evaluate)
        return point, step_from(problem, point.without(held), values, logs)

    def moved(_: AnyArray, at: tuple[Vector, Effects]) -> tuple[Vector, Effects]:
        _, step = linearised(*at)
        return at[0] + step.move, step.effects

    values, logs = jax.lax.fori_loop(0, _ROUNDS, moved, (values, logs))
    return Solution(values, logs, *linearised(values, logs), held)


def held_parameters(problem: Problem, values: Vector, errors: Vector) -> Mask:
    """Mask of the parameters that fade and may have no effect: the residuals are not linear in
    them, so that they keep their values. The errors are those of the parameters themselves.
    """
    axes = straight(problem)
    own = errors / abs(axes.slopes(axes.values(values)))
    return namespace(values).asarray(axes.fades) & ~(values > _NO_EFFECT * own)


def affected(problem: Problem, estimate: Estimate[Problem]) -> int:
    """Number of impacts that may scatter; at least those of the fitted motion."""
    count = estimate.impacts.count
    if problem.recording.observes_impacts or not is_known(count):
        return problem.impacts
    return min(padded_size(max(int(count), 1)), problem.impacts)


def _is_small(step: Step, logs: Effects) -> bool:
    """True for a step that changes no value or logarithm by a noticeable share of its error."""
    model = step.model
    errors = np.sqrt(np.diagonal(model.covariance))
    moves = np.abs(step.move) > _SETTLED * np.where(model.determined, errors, np.inf)
    size = float(model.expected_size)
    return not np.any(moves) and bool(np.all(np.abs(step.effects - logs) <= _SETTLED * size))


def _moved(
    problem: Problem, evaluate: Evaluate, point: Around, values: Vector, logs: Effects, step: Step
) -> tuple[Vector, Effects, Around] | None:
    """The point after the largest share of a step that does not raise the penalised sum of squares;
    `None` if no share does.
    """
    change = step.effects - logs
    expected = point.residuals + point.jacobian @ step.move + point.effects @ change
    noise = max(np.sum(expected**2) / counted(problem, expected), np.finfo(values.dtype).tiny)
    size = step.model.expected_size

    def cost(residuals: Residuals, values: Vector, effects: Effects) -> float:
        prior = problem.prior_rows(straight(problem).values(values)).squares
        return float(np.sum(residuals**2) / noise + np.sum((effects / size) ** 2) + prior)

    most = cost(point.residuals, values, logs) + _SLACK
    for share in _SHARES:
        moved, effects = values + share * step.move, logs + share * change
        if cost(residuals_at(problem, moved, effects, evaluate), moved, effects) <= most:
            there = around(problem, moved, effects, evaluate)
            return (moved, effects, there) if there.exists() else None
    return None
