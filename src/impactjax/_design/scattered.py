"""Refits with restitution that scatters: the factors of the impacts are found with the parameters.

The factor of an impact is exp(s ξ) with a standard normal ξ, so that a refit minimises

    Σ residual²/σ² + Σ ξ² + Σ ((p − mean)/sigma)² over the priors.

To first order its parameters are those of generalised least squares, with the covariance of noise
and scatter together.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from impactjax._fit.bootstrap import simulated
from impactjax._fit.linear_scatter import around_values
from impactjax._fit.search import bounds_of
from impactjax._known import AnyArray, known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Linearisation, Vector, linearise
from impactjax._optimise.minimiser import Count, Minimiser, Minimum, Objective, Point
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import Answer
from impactjax._problem.joint_problem import JointProblem
from impactjax._problem.padding import padded_size
from impactjax._problem.problem import Problem

_NEWTON = LevenbergMarquardt(reduction=1e-6, damping=1e-12)  # only the priors tell r from a mean ξ
_ANY = Range("1", -math.inf, math.inf, excludes_low=False, known=False)  # of a deviation ξ


class Rows(NamedTuple):
    """Residuals of a joint problem, with their derivatives.

    - `residuals`: in units of their noise.
    - `jacobian`: derivatives by the coordinates of a search.
    - `effects`: derivatives by the deviations of all motions, one after the other.
    """

    residuals: Float[AnyArray, " observations"]
    jacobian: Float[AnyArray, "observations parameters"]
    effects: Float[AnyArray, "observations impacts"]


class Scattered(NamedTuple):
    """A joint problem in which the speeds after impacts scatter.

    - `joint`: the problem without scatter.
    - `motions`: number of the motion of each recording.
    - `impacts`: for each motion, how many impacts may have a factor.
    - `size`: standard deviation s of the logarithm of a factor [1].
    """

    joint: JointProblem
    motions: tuple[int, ...]
    impacts: tuple[int, ...]
    size: float

    def refit(self, key: Key[Array, ""]) -> Minimum:
        """The minimum for a simulated recording, from the true values and no scatter. The first
        coordinates are those of the parameters.
        """
        of_noise, of_scatter = jax.random.split(key)
        start = known(self.joint.coordinates(known(self.joint.start)))
        scatter = known(jax.random.normal(of_scatter, (sum(self.impacts),), start.dtype))
        exact = self.rows(start, scatter).residuals
        drawn = simulated(self.joint, jnp.asarray(exact), of_noise)
        return self._replace(joint=drawn).minimum(start)

    def minimum(self, start: Vector) -> Minimum:
        """The minimum from a start without scatter."""
        begun = np.concatenate([start, np.zeros(sum(self.impacts), start.dtype)])
        ranges = [*self.joint.ranges(), *[_ANY] * sum(self.impacts)]
        reductions = np.asarray([_NEWTON.reduction], start.dtype)
        objective: Objective[Linearisation] = Objective(_evaluated, reductions)
        nothing: Point = Point(begun, None, _infinite(begun))
        bounds = bounds_of(ranges, begun, np.ones(begun.shape, bool))
        minimiser = Minimiser(_NEWTON, objective, bounds, nothing)
        with np.errstate(all="ignore"):
            state = minimiser.init(begun)
            while not state.done:
                state = minimiser.step(state, self.model(state.trial))
        return state.minimum

    def model(self, at: Vector) -> Linearisation:
        """The linear model around coordinates of the parameters and deviations."""
        place, deviations = np.split(at, [len(self.joint.names)])
        rows = self.rows(place, deviations)
        residuals = np.concatenate([rows.residuals, deviations])
        own = np.concatenate([rows.jacobian, np.zeros((len(deviations), len(place)))])
        effects = np.concatenate([rows.effects, np.eye(len(deviations))])
        jacobian = np.concatenate([own, effects], axis=1)
        if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
            return _infinite(at)
        return linearise(np.sum(residuals**2) / 2, residuals, jacobian)

    def rows(self, place: Vector, deviations: Float[AnyArray, " impacts"]) -> Rows:
        """The residuals and their derivatives."""
        values, begin = known(self.joint.at(place)), np.cumsum([0, *self.impacts])
        answers, effects = [], []
        each = zip(self.joint.each_recording(), self.motions, self.joint.sizes, strict=True)
        for (problem, places), motion, sigma in each:
            count = min(self.impacts[motion], problem.padded().impacts)
            columns = slice(begin[motion], begin[motion] + count)
            logs = self.size * deviations[columns]
            point = around_values(problem, values[list(places)], logs)
            answers.append(Answer(point.residuals, point.impacts, point.jacobian))
            own = np.zeros((len(point.residuals), len(deviations)), place.dtype)
            own[:, columns] = self.size * point.effects / known(sigma)
            effects.append(own)
        joined = known(self.joint.joined(values, answers))
        effects.append(np.zeros((len(self.joint.priors), len(deviations)), place.dtype))
        slopes = known(self.joint.slopes(place))
        return Rows(joined.residuals, joined.jacobian * slopes, np.concatenate(effects))


def scattered(joint: JointProblem, motions: Sequence[int], size: float) -> Scattered:
    """The joint problem with scatter of some size. Twice as many impacts may have a factor as
    happen at the true values.
    """
    values, most = known(joint.start), [1] * (max(motions) + 1)
    for (problem, places), motion in zip(joint.each_recording(), motions, strict=True):
        count = _affected(problem, values[list(places)])
        most[motion] = max(most[motion], count)
    return Scattered(joint, tuple(motions), tuple(most), size)


def _affected(problem: Problem, values: Vector) -> int:
    nothing = np.zeros(problem.padded().impacts, values.dtype)
    happen = int(around_values(problem, values, nothing).impacts.count)
    return min(padded_size(2 * max(happen, 1)), len(nothing))


def _evaluated(at: Vector, model: Linearisation, part: Count) -> Linearisation:
    """The linear model that an evaluation returned: there is one part, the whole."""
    del at, part
    return model


def _infinite(at: Vector) -> Linearisation:
    """The linear model of residuals that do not exist."""
    count = len(at)
    return Linearisation(np.full((), np.inf, at.dtype), np.zeros(count), np.zeros((count, count)))
