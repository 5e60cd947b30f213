"""The verb `predicted`: the profile likelihood of a prediction."""

import math
from collections.abc import Callable
from typing import TypeVar

import equinox as eqx
import numpy as np

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.profile import limit_of
from impactjax._fit.profile_walk import Walk
from impactjax._fit.refits import Refits, Rows, refits_of
from impactjax._fit.search import Search
from impactjax._identify.begun import values_along
from impactjax._identify.curves import Knots, Span, merged, traced
from impactjax._identify.held_quantity import HeldQuantity, told
from impactjax._identify.profile_axis import Axis, reach
from impactjax._identify.profile_curve import Profile, profile_along
from impactjax._identify.profiles import check_profiled
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._parameter import Range
from impactjax._problem.single_problem import AbstractSingleProblem
from impactjax._refusal import check_function
from impactjax._types import Scalar

System = TypeVar("System", bound=eqx.Module)

_ROUNDS = 12  # most refits on one side


def predicted(
    estimate: Estimate[AbstractSingleProblem[System]],
    quantity: Callable[[System], Scalar],
    *,
    points: int = 41,
    name: str = "prediction",
    unit: str = "1",
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Profile:
    """Profile likelihood of a prediction, such as a restitution at a speed that was not measured.

    The quantity g is held at values around its estimate, and all parameters are fitted again:
    rise(v) = (min_{g = v} S − S_min)/(σ² i²). The interval holds the values that the recording
    allows, also where g depends on the parameters nonlinearly or on one at the end of its range.

    **Arguments:**

    - `estimate`: estimate of a single fit of one recording, without scatter from impact to impact.
    - `quantity`: differentiable function of the fitted `System`, with its `model`, `initial` state
      and `sensor`, or of the part of `fit_data`, that returns a number:
      `lambda system: system.model.lower.law.restitution(0.2)`.
    - `points`: number of points of the curve.
    - `name`, `unit`: of the quantity, for figures.
    - `optimiser`: settings of the refits.

    **Raises** `ValueError` as `profiles` does, and for a quantity that is not finite at the
    estimate or does not depend on the fitted parameters.

    Source: Kreutz, Raue and Timmer (2012), BMC Systems Biology 6, 120.
    """
    check_profiled(estimate, points, optimiser)
    check_function("quantity", quantity)
    if not isinstance(estimate.problem, AbstractSingleProblem):
        raise ValueError("A prediction is of one recording that was fitted alone.")
    refits = refits_of(estimate, optimiser, Search())
    u = np.asarray(refits.problem.coordinates(np.asarray(estimate.values)))[None]
    (centre,), slopes = told(refits, quantity, u)
    if not math.isfinite(centre):
        raise ValueError("Argument `quantity` is not finite at the estimate.")
    if not slopes.any():
        raise ValueError("Argument `quantity` does not depend on the fitted parameters.")
    error, inflation = _errors(estimate, refits, u, slopes)
    curve = HeldQuantity(refits, quantity, centre, error)
    limit = limit_of(estimate)
    sides = (-1, 1)
    walks = [Walk(0, x, centre, error, False, math.inf, limit * inflation) for x in sides]
    knots = curve.refitted(np.zeros(1, int), np.zeros(1), u)
    for walk in walks:
        knots = _walked(curve, walk, knots)
    low, high = (reach(walk) for walk in walks)
    span = Span(low, high, refits.lowest, walks[0].limit ** 2 * refits.variance / 2)
    found = traced(curve, [knots], [span], points, [knots.taken([])])[0]
    anything = Range(unit, -math.inf, math.inf, excludes_low=False, known=False)
    axis = Axis(centre, error, False, anything, anything)
    known = (not walks[0].failed, not walks[1].failed)
    parameters = (estimate.names, values_along(refits, found))
    doubtful = bool(estimate.doubtful)
    return profile_along(name, axis, found, span, limit**2, known, parameters, doubtful=doubtful)


def _errors(estimate: Estimate[P], refits: Refits, u: Rows, slopes: Rows) -> tuple[float, float]:
    """The standard error of a quantity from its slopes by the coordinates of a search, and its
    inflation by correlated residuals, at least 1. If the error is not finite, the size of the
    quantity's terms and the largest inflation of a parameter.
    """
    scale = np.asarray(refits.problem.slopes(u[0]))
    own, felt = slopes[0] / scale, slopes[0] != 0
    covariance = np.asarray(estimate.covariance)[np.ix_(felt, felt)]
    if not np.isfinite(covariance).all():
        most = float(np.asarray(estimate.inflation).max())
        return float(np.abs(own * np.asarray(estimate.values)).max()), max(most, 1.0)
    error = math.sqrt(own[felt] @ covariance @ own[felt])
    free = np.ones(u.shape, bool)
    around = refits.points(u, free)._replace(moving=free)
    plain = math.sqrt(refits.variance * float((slopes * around.solved(slopes)).sum()))
    return error, max(error / plain, 1.0)


def _walked(curve: HeldQuantity, walk: Walk, knots: Knots) -> Knots:
    """The points of a curve with those of a walk to the end of the interval."""
    refits, one = curve.refits, np.zeros(1, int)
    for _ in range(_ROUNDS):
        if walk.done:
            break
        x = np.array([(walk.next_value() - curve.centre) / curve.unit])
        new = curve.refitted(one, x, knots.start(x))
        walk.learn(float(refits.heights(new.cost)[0]))
        knots = merged(knots, new.finite)
    return knots
