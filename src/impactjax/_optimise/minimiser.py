"""Nonlinear least squares by the Levenberg-Marquardt method, one evaluation at a time.

A search is a state and two functions: `init` makes the first state, which names a point to
evaluate, and `step` takes the result of that evaluation to the next state, until that is `done`.
The caller evaluates the residuals. So the same code runs in NumPy, with many searches evaluated in
one call, and inside a program that JAX traces.

Source: H. B. Nielsen (1999), "Damping parameter in Marquardt's method", IMM-REP-1999-05, Technical
University of Denmark, for the damping; K. Madsen, H. B. Nielsen and O. Tingleff (2004), "Methods
for non-linear least squares problems", section 3.2, for the whole method.
"""

import dataclasses
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float, Int

from impactjax._known import AnyArray, either, is_known, namespace
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Linearisation, Vector
from impactjax._outcome import Outcome

_TIE = 0.001  # share of the strongest curvature in the damping of each parameter
_GROWTH = 2.0  # Nielsen's ν: factor of the damping when a step is rejected for the first time
_OPEN = 1e-3  # share of the cost that a search does not leave to be gained
_TOO_MUCH = 1e12  # damping at which a search gives up

T = TypeVar("T")
Mask = Bool[AnyArray, " parameters"]
Number = Float[AnyArray, ""]
Flag = Bool[AnyArray, ""]
Count = Int[AnyArray, ""]


@dataclasses.dataclass(frozen=True, eq=False)
class Objective(Generic[T]):
    """Function to be minimised: the cost of growing parts of the observations, of which the last is
    the whole.

    - `around`: the linear model of the residuals of a part around a point, from the evaluation of
      that point.
    - `onwards`: the start of the search in the next part, from the minimum of the previous one.
    - `reductions`: for each part, the relative decrease of the cost that counts as convergence.
    """

    around: Callable[[Vector, T, Count], Linearisation]
    onwards: Callable[[Vector], Vector]
    reductions: Float[AnyArray, " parts"]


class Bounds(NamedTuple):
    """Limits of a search.

    - `active`: mask of the parameters that may move.
    - `reach`: limit of a step, for each parameter.
    - `usual`: limit of a step along directions that the data hardly determine, such as that along
      which only the sum of two parameters matters; `inf` for no such limit.
    """

    active: Mask
    reach: Vector
    usual: Vector


class Minimum(eqx.Module, Generic[T]):
    """Result of a search."""

    u: Float[AnyArray, "... parameters"]
    answer: T
    cost: Float[AnyArray, "..."]
    outcome: Int[AnyArray, "..."]  # an `Outcome` number
    iterations: Int[AnyArray, "..."]

    @property
    def converged(self) -> Bool[AnyArray, "..."]:
        """True if the search converged."""
        return self.outcome == Outcome.CONVERGED


class Point(eqx.Module, Generic[T]):
    """A point with its evaluation; the cost is infinite before that, or if it is not finite."""

    u: Vector
    answer: T
    model: Linearisation

    @property
    def is_known(self) -> Flag:
        """True if the point was evaluated and has a finite cost."""
        return namespace(self.u).isfinite(self.model.cost)


class State(eqx.Module, Generic[T]):
    """State of a search.

    - `best`: the lowest point so far; before the first evaluation, the start.
    - `trial`: the point to evaluate next.
    - `predicted`: decrease of the cost from `best` to `trial` in the linear model.
    - `damping`, `growth`: λ, and Nielsen's ν, by which λ grows if the trial is rejected.
    - `part`: index of the part of the observations that is being fitted.
    - `left`: evaluations left for this part.
    - `converged`, `done`: for this part; a search that failed is done without convergence.
    """

    best: Point[T]
    trial: Vector
    predicted: Number
    damping: Number
    growth: Number
    part: Count
    left: Count
    converged: Flag
    done: Flag
    iterations: Count

    @property
    def minimum(self) -> Minimum[T]:
        """The result of a search that is done."""
        best = self.best
        return Minimum(best.u, best.answer, best.model.cost, self.outcome, self.iterations)

    @property
    def outcome(self) -> Count:
        """The `Outcome` number of a search that is done."""
        xp, simulated = namespace(self.trial), self.best.is_known
        failed = xp.where(self.left == 0, Outcome.MAX_ITERATIONS, Outcome.NO_DESCENT)
        failed = xp.where(simulated, failed, Outcome.NOT_SIMULATED)
        return xp.where(self.converged, Outcome.CONVERGED, failed).astype(np.int32)


@dataclasses.dataclass(frozen=True, eq=False)
class Minimiser(Generic[T]):
    """Levenberg-Marquardt search, one evaluation at a time.

    Step: the p that minimises ‖r + J p‖² + λ pᵀ S p, with S the diagonal of Jᵀ J plus a small share
    of its strongest entry; shortened as a whole where it exceeds `Bounds.reach`.

    Damping: with the gain ratio ρ = actual decrease / predicted decrease, an accepted step gives
    λ ← λ max(1/3, 1 − (2ρ − 1)³); a rejected one gives λ ← ν λ and ν ← 2ν.

    Convergence: the predicted and the actual decrease of the last step are both at most
    `reduction` × cost. On every part but the last it is enough that a Gauss-Newton step would gain
    no more than that.

    A parameter whose curvature is negligible over its longest step is held for this iteration. A
    point whose cost is not finite is never accepted.

    - `nothing`: a point that has not been evaluated.
    """

    settings: LevenbergMarquardt
    objective: Objective[T]
    bounds: Bounds
    nothing: Point[T]

    def init(self, start: Vector) -> State[T]:
        """State before the first evaluation."""
        zero = namespace(start).zeros((), np.int32)
        return self._fresh(dataclasses.replace(self.nothing, u=start), zero, zero)

    def step(self, state: State[T], answer: T) -> State[T]:
        """State after the evaluation of the trial point. A part of the observations that is done
        is followed by the next one.
        """
        model = self.objective.around(state.trial, answer, state.part)
        state = self._learned(state, Point(state.trial, answer, model))
        for _ in range(self.objective.reductions.shape[0] - 1):
            over = state.done & self._is_early(state.part)
            state = either(over, lambda state=state: self._next_part(state), state)
        return self._proposed(state)

    def _fresh(self, best: Point[T], part: Count, iterations: Count) -> State[T]:
        xp = namespace(best.u)
        damping, growth = (
            xp.full_like(best.u[0], each) for each in (self.settings.damping, _GROWTH)
        )
        left, found = xp.full_like(part, self.settings.max_iterations), self._is_enough(best, part)
        zero = xp.zeros_like(damping)
        return State(best, best.u, zero, damping, growth, part, left, found, found, iterations)

    def _next_part(self, state: State[T]) -> State[T]:
        best, part, u = state.best, state.part + 1, self.objective.onwards(state.best.u)
        seen = Point(u, best.answer, self.objective.around(u, best.answer, part))
        stays = namespace(u).all(u == best.u) & best.is_known & seen.is_known
        start = either(stays, lambda: seen, dataclasses.replace(self.nothing, u=u))
        return self._fresh(start, part, state.iterations)

    def _proposed(self, state: State[T]) -> State[T]:
        """State with its next trial point: the best point itself if it was not yet evaluated."""
        xp, best = namespace(state.trial), state.best
        moving = _moving(best.model, self.bounds, self._small(best, state.part))
        move = _move(best.model, state.damping, moving, self.bounds)
        move = xp.where(best.is_known, move, 0.0)
        predicted = best.model.decrease(move)
        return dataclasses.replace(state, trial=best.u + move, predicted=predicted)

    def _learned(self, state: State[T], trial: Point[T]) -> State[T]:
        xp, best, predicted = namespace(state.trial), state.best, state.predicted
        gained = best.model.cost - trial.model.cost
        accepted = trial.is_known & (gained > 0)
        ratio = gained / xp.where(predicted > 0, predicted, 1.0)
        easier = xp.maximum(1 / 3, 1 - (2 * ratio - 1) ** 3)
        damping = state.damping * xp.where(accepted, easier, state.growth)
        damping = xp.where(best.is_known, damping, state.damping)
        small = self._small(best, state.part)
        flat = (predicted <= small) & (xp.where(accepted, gained, 0.0) <= small)
        lowest = either(accepted, lambda: trial, best)
        # With it in a traced search, XLA's multi-output fusion aborts (JAX 0.10).
        settled = self._is_settled(lowest.model) if is_known(lowest.model) else True
        found = (best.is_known & flat & settled) | self._is_enough(lowest, state.part)
        hopeless = (~best.is_known & ~accepted) | (damping > _TOO_MUCH) | (state.left == 1)
        return dataclasses.replace(
            state,
            best=lowest,
            damping=damping,
            growth=xp.where(accepted, _GROWTH, 2 * state.growth),
            left=state.left - 1,
            converged=found,
            done=found | hopeless,
            iterations=state.iterations + 1,
        )

    def _is_settled(self, model: Linearisation) -> Flag:
        """True unless damping alone makes a step small, beside a parameter at the end of its range.

        Such a parameter has an undamped step beyond its reach. The search goes on if holding it
        there leaves the others more than a share `_OPEN` of the cost to gain.
        """
        xp, moving = namespace(model.cost), self.bounds.active & (model.curvature > 0)
        far = xp.abs(_undamped(model, moving)) > self.bounds.reach
        gain = _expected_gain(model, moving & ~far)
        return ~(xp.any(far) & (gain > _OPEN * model.cost))

    def _is_enough(self, best: Point[T], part: Count) -> Flag:
        """True if this part is not the last and is fitted well enough."""
        small = self._small(best, part)
        gain = _expected_gain(best.model, _moving(best.model, self.bounds, small))
        return self._is_early(part) & best.is_known & (gain <= small)

    def _is_early(self, part: Count) -> Flag:
        return part < self.objective.reductions.shape[0] - 1

    def _small(self, best: Point[T], part: Count) -> Number:
        return self.objective.reductions[part] * best.model.cost


def _moving(model: Linearisation, bounds: Bounds, small: Number) -> Mask:
    """Mask of the active parameters whose longest step would change the cost noticeably:
    (Jᵀ J)ᵢᵢ reachᵢ² > small.
    """
    return bounds.active & (model.curvature * bounds.reach**2 > small)


def _move(model: Linearisation, damping: Number, moving: Mask, bounds: Bounds) -> Vector:
    xp, usual = namespace(model.rest), bounds.usual
    tied = moving & xp.isfinite(usual)
    strongest = xp.max(xp.where(tied, model.curvature * usual**2, 0.0))
    move = model.step(_weights(model.curvature + _TIE * strongest / usual**2, moving), damping)
    return move / xp.maximum(xp.max(xp.abs(move) / bounds.reach), 1.0)


def _undamped(model: Linearisation, moving: Mask) -> Vector:
    """The Gauss-Newton step of the parameters that move."""
    return model.step(_weights(model.curvature, moving), 0.0)


def _expected_gain(model: Linearisation, moving: Mask) -> Number:
    """Decrease of the cost by a Gauss-Newton step."""
    return model.decrease(_undamped(model, moving))


def _weights(squares: Vector, moving: Mask) -> Vector:
    xp = namespace(squares)
    return xp.where(moving, xp.sqrt(xp.where(moving, squares, 1.0)), 0.0)
