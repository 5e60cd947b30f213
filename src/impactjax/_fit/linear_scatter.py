"""Linear model of the residuals around a point, and the step to the solution of its mixed model.

It is linear in the parameters and in the logarithms uᵢ = s ξᵢ of the factors of the impacts. The
derivatives by these are directional ones, an evaluation for each impact, so that the program of the
search serves.
"""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float

from impactjax._fit.evaluation import Evaluate, answer_at, evaluate, side_by_side
from impactjax._fit.informed_model import informed
from impactjax._fit.mixed_model import MixedModel, Observed, OwnNoise, mixed_model
from impactjax._fit.straight import straight
from impactjax._known import AnyArray, is_known, known, namespace
from impactjax._problem.abstract_problem import Answer
from impactjax._problem.prior import PriorRows
from impactjax._problem.problem import Problem
from impactjax._simulate.impact_log import ImpactLog

_CERTAIN = 1e8  # degrees of freedom that stand for a known variance
_LOST = 1e-10  # relative singular value of a direction without information
_ROUNDING = 1e-14  # size of a direction of noise that is rounding, relative to the largest
_ENDS = 3  # times that parameters which leave their range are stopped at its end
_INSIDE = 1e-12  # distance from an end that a range excludes

Vector = Float[AnyArray, " parameters"]
Mask = Bool[AnyArray, " parameters"]
Effects = Float[AnyArray, " impacts"]
Direction = Float[AnyArray, " capacity"]  # of all impacts that may have a factor


class Around(NamedTuple):
    """Residuals around a point: simulated minus recorded, and their derivatives.

    - `residuals`, `impacts`: at the point.
    - `jacobian`: derivatives by straight coordinates of the parameters.
    - `effects`: derivatives by the logarithms of the factors.
    - `prior`: prior knowledge, with its derivatives by the same coordinates.
    """

    residuals: Float[AnyArray, " observations"]
    jacobian: Float[AnyArray, "observations parameters"]
    effects: Float[AnyArray, "observations impacts"]
    impacts: ImpactLog
    prior: PriorRows

    def exists(self) -> bool:
        """True if all numbers are finite."""
        numbers = self.residuals, self.jacobian, self.effects
        return all(bool(np.all(np.isfinite(np.asarray(each)))) for each in numbers)

    def without(self, held: Mask) -> "Around":
        """The model in which some parameters do not change."""
        xp = namespace(self.jacobian)
        slopes = xp.where(held, 0.0, self.prior.slopes)
        jacobian = xp.where(held, 0.0, self.jacobian)
        return self._replace(jacobian=jacobian, prior=self.prior._replace(slopes=slopes))

    def moved(self, move: Vector) -> "Around":
        """The model around other values of the parameters."""
        residuals = self.residuals + self.jacobian @ move
        deviations = self.prior.deviations + self.prior.slopes @ move
        prior = self.prior._replace(deviations=deviations)
        return self._replace(residuals=residuals, prior=prior)


def around(problem: Problem, values: Vector, logs: Effects, evaluate: Evaluate) -> Around:
    """The linear model around straight coordinates of the parameters and some logarithms.

    If all numbers are known, `evaluate` runs once for each impact that happens.
    """
    axes, count = straight(problem), logs.shape[0]
    own = axes.values(values)
    slopes, prior = axes.slopes(own), problem.prior_rows(own)
    prior = prior._replace(slopes=prior.slopes * slopes)
    directions = np.eye(problem.impacts, count, dtype=values.dtype).T

    def at(direction: Direction) -> tuple[AnyArray, AnyArray, AnyArray, ImpactLog]:
        answer = _answer(problem, values, logs, direction, evaluate)
        assert answer.jacobian is not None
        assert answer.effect is not None
        return answer.residuals, answer.jacobian, answer.effect, answer.impacts

    if not is_known((problem, values)):
        residuals, jacobian, effects, impacts = jax.lax.map(at, directions)
        residuals, jacobian, impacts = jax.tree.map(lambda x: x[0], (residuals, jacobian, impacts))
        return Around(residuals, jacobian * slopes, effects.T, impacts, prior)
    residuals, jacobian, effect, impacts = known(at(directions[0]))
    happen = max(min(int(impacts.count), count), 1)
    others = side_by_side(lambda direction: known(at(direction)[2]), directions[1:happen])
    none = [np.zeros_like(effect)] * (count - happen)
    effects = np.stack([effect, *others, *none], axis=1)
    return Around(residuals, jacobian * slopes, effects, impacts, prior)


def around_values(
    problem: Problem, values: Vector, logs: Effects, by: Evaluate = evaluate
) -> Around:
    """The linear model of a recording around values of its parameters, by these themselves, and
    around some logarithms. If all numbers are known, it is that of the padded problem without the
    rows of the padding.
    """
    own, axes = problem.padded() if is_known(problem) else problem, straight(problem)
    point, count = around(own, axes.places(values), logs, by), problem.valid.shape[-1]
    return Around(
        known(point.residuals)[:count],
        known(point.jacobian)[:count] / axes.slopes(values),
        known(point.effects)[:count],
        point.impacts,
        problem.prior_rows(values),
    )


def residuals_at(
    problem: Problem, values: Vector, logs: Effects, evaluate: Evaluate
) -> Float[AnyArray, " observations"]:
    """The residuals at straight coordinates of the parameters and some logarithms."""
    nowhere = np.zeros(problem.impacts, values.dtype)
    return known(_answer(problem, values, logs, nowhere, evaluate).residuals)


def _answer(
    problem: Problem, values: Vector, logs: Effects, direction: Direction, evaluate: Evaluate
) -> Answer:
    scattered = problem.scattered(logs, direction)
    return answer_at(scattered, straight(problem).values(values), logged=True, by=evaluate)


class Step(NamedTuple):
    """Solution of the mixed model around a point.

    - `model`: the solution, in changes of the parameters.
    - `move`: change of the parameters.
    - `effects`: new logarithms of the factors.
    - `stopped`: mask of the parameters that stop at an end of their range.
    - `unlimited`: the solution without ranges.
    """

    model: MixedModel
    move: Vector
    effects: Effects
    stopped: Mask
    unlimited: MixedModel


def step_from(problem: Problem, point: Around, values: Vector, logs: Effects) -> Step:
    """The step to the solution of the mixed model around a point. Parameters that would leave their
    range stop at its end, and the others follow.
    """
    xp, (low, high) = namespace(values), _ends(problem, values)
    stopped, move = xp.zeros(values.shape, bool), xp.zeros_like(values)
    model = unlimited = solved(problem, point, logs)
    for _ in range(_ENDS):
        move = xp.where(stopped, move, model.value)
        beyond = (values + move < low) | (values + move > high)
        move, stopped = xp.clip(values + move, low, high) - values, stopped | beyond
        if is_known((values, stopped)) and not np.any(beyond):
            break
        fixed = xp.where(stopped, move, 0.0)
        model = solved(problem, point.moved(fixed).without(stopped), logs)
    move = xp.clip(values + xp.where(stopped, move, model.value), low, high) - values
    return Step(model, move, model.effect, stopped, unlimited)


def _ends(problem: Problem, values: Vector) -> tuple[Vector, Vector]:
    """The ends of the ranges of straight coordinates."""
    xp, ranges = namespace(values), straight(problem).ranges
    low = [each.low + (_INSIDE if each.excludes_low else 0.0) for each in ranges]
    return xp.asarray(low, values.dtype), xp.asarray([x.high for x in ranges], values.dtype)


def solved(problem: Problem, point: Around, logs: Effects) -> MixedModel:
    """The mixed model around a point, in changes of the parameters."""
    data, prior = _observed(problem, point, logs), point.prior
    model = mixed_model(data)
    return informed(data, model, prior) if prior.deviations.shape[0] else model


def _observed(problem: Problem, point: Around, logs: Effects) -> Observed:
    """The record as a mixed model has it."""
    observed = point.effects @ logs - point.residuals
    variance = problem.variance()
    if in_units_of_noise(problem):
        return _whitened(problem, observed, point.jacobian, point.effects)
    zero = namespace(observed).zeros_like(observed[0])
    own = OwnNoise(zero, zero)
    if variance is not None:
        own = OwnNoise(zero + _CERTAIN, _CERTAIN * known(variance))
    return Observed(observed, point.jacobian, point.effects, counted(problem, observed), own)


def in_units_of_noise(problem: Problem) -> bool:
    """True for a recorded motion with noise of an unknown size, of which the mixed model has the
    rows in units of the noise.
    """
    return problem.variance() is None and not problem.recording.observes_impacts


def counted(problem: Problem, like: AnyArray) -> AnyArray:
    """The number of observations, of the type of another number."""
    return namespace(like).sum(known(problem.valid)).astype(like.dtype)


def _whitened(
    problem: Problem, observed: AnyArray, jacobian: AnyArray, effects: AnyArray
) -> Observed:
    """A recorded motion along the directions of parameters and scatter, in units of its noise.

    The noise model of the problem gives the covariance of the noise along these directions, from
    the residuals that lie in none of them.
    """
    xp = namespace(observed)
    both = xp.concatenate([jacobian, effects], axis=1)
    norms = xp.linalg.norm(both, axis=0)
    axes, lengths, _ = xp.linalg.svd(both / xp.where(norms > 0, norms, 1.0), full_matrices=False)
    felt = lengths > _LOST * xp.max(lengths)
    axes = xp.where(felt, axes, 0.0)
    rest = observed - axes @ (axes.T @ observed)
    count, p = counted(problem, observed), xp.sum(felt.astype(observed.dtype))
    size = xp.sum(rest**2) / count
    spread = known(problem.noise.spread(rest, count, axes))
    kappa = xp.trace(spread) / (p * size)
    freedom = xp.maximum(count / xp.maximum(kappa, 1.0) - p, 1.0)
    spread = spread * count / (count - p) + xp.diag(xp.where(felt, 0.0, 1.0))
    sizes, turned = xp.linalg.eigh(spread)
    least = xp.maximum(_ROUNDING * xp.max(sizes), np.finfo(sizes.dtype).tiny)
    scaled = axes @ (turned / xp.sqrt(xp.maximum(sizes, least)))

    def white(columns: AnyArray) -> AnyArray:
        return scaled.T @ columns

    own = OwnNoise(freedom, freedom)
    return Observed(white(observed), white(jacobian), white(effects), p, own)
