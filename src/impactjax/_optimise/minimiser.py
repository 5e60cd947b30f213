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

import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

from impactjax._known import AnyArray, either, is_known, namespace
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Linearisation, Vector
from impactjax._outcome import Outcome

_TIE = 0.001  # share of the strongest curvature in the damping of each parameter
_LOOSE = 10.0  # usual steps that a parameter has still to go if its start says nothing of them
_SLIGHT = 1e-6  # damping that hardly shortens a step
_GROWTH = 2.0  # Nielsen's ν: factor of the damping when a step is rejected for the first time
_PASSES = 2  # solutions of a step after which parameters that it takes out of range are held
_TOO_MUCH = 1e12  # damping at which a search gives up

T = TypeVar("T")
Mask = Bool[AnyArray, " parameters"]
Number = Float[AnyArray, ""]
Flag = Bool[AnyArray, ""]
Count = Int[AnyArray, ""]

# In states, which may be batches of many searches.
Each = Float[AnyArray, "... parameters"]
PerSearch = Float[AnyArray, "..."]
Flags = Bool[AnyArray, "..."]
Counts = Int[AnyArray, "..."]


@dataclasses.dataclass(frozen=True, eq=False)
class Objective(Generic[T]):
    """Function to be minimised: the cost of growing parts of the observations, of which the last is
    the whole.

    - `around`: the linear model of the residuals of a part around a point, from the evaluation of
      that point.
    - `reductions`: for each part, the relative decrease of the cost that counts as convergence.
    """

    around: Callable[[Vector, T, Count], Linearisation]
    reductions: Float[AnyArray, " parts"]


class Bounds(NamedTuple):
    """Limits of a search.

    - `active`: mask of the parameters that may move.
    - `low`, `high`: ends of the range of each parameter; may be infinite.
    - `reach`: limit of a step, for each parameter.
    - `usual`: limit of a step along directions that the data hardly determine, such as that along
      which only the sum of two parameters matters; `inf` for no such limit.
    """

    active: Mask
    low: Vector
    high: Vector
    reach: Vector
    usual: Vector


class Minimum(NamedTuple):
    """Result of a search."""

    u: Each
    answer: PyTree
    model: Linearisation  # of all observations around `u`
    outcome: Counts  # an `Outcome` number
    iterations: Counts

    @property
    def cost(self) -> PerSearch:
        """The cost, half the sum of squares; infinite without a finite evaluation."""
        return self.model.cost

    @property
    def converged(self) -> Flags:
        """True if the search converged."""
        return self.outcome == Outcome.CONVERGED


class Point(NamedTuple):
    """A point with its evaluation; the cost is infinite before that, or if it is not finite."""

    u: Each
    answer: PyTree
    model: Linearisation

    @property
    def is_known(self) -> Flag:
        """True if the point was evaluated and has a finite cost."""
        return namespace(self.u).isfinite(self.model.cost)


class State(NamedTuple):
    """State of a search.

    - `best`: the lowest point so far; before the first evaluation, the start.
    - `trial`: the point to evaluate next.
    - `predicted`: decrease of the cost from `best` to `trial` in the linear model.
    - `damping`, `growth`: λ, and Nielsen's ν, by which λ grows if the trial is rejected.
    - `part`: index of the part of the observations that is being fitted.
    - `left`: evaluations left for this part.
    - `converged`, `done`: for this part; a search that failed is done without convergence.
    """

    best: Point
    trial: Each
    predicted: PerSearch
    damping: PerSearch
    growth: PerSearch
    part: Counts
    left: Counts
    converged: Flags
    done: Flags
    iterations: Counts

    @property
    def minimum(self) -> Minimum:
        """The result of a search that is done."""
        best = self.best
        return Minimum(best.u, best.answer, best.model, self.outcome, self.iterations)

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
    of its strongest entry; shortened as a whole where it exceeds `Bounds.reach`. A parameter at the
    end of its range is held if the cost falls outwards. One that the step would take out of its
    range goes to the end of it, and the step of the others is solved again.

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
    nothing: Point

    def init(self, start: Vector) -> State:
        """State before the first evaluation."""
        zero = namespace(start).zeros((), np.int32)
        return self._fresh(self.nothing._replace(u=start), zero, zero)

    def step(self, state: State, answer: T) -> State:
        """State after the evaluation of the trial point. A part of the observations that is done
        is followed by the next one.
        """
        model = self.objective.around(state.trial, answer, state.part)
        state = self._learned(state, Point(state.trial, answer, model))
        for _ in range(self.objective.reductions.shape[0] - 1):
            over = state.done & self._is_early(state.part)
            state = either(over, lambda state=state: self._next_part(state), state)
        return self._proposed(state)

    def _fresh(self, best: Point, part: Count, iterations: Count) -> State:
        xp = namespace(best.u)
        damping, growth = (
            xp.full_like(best.u[0], each) for each in (self.settings.damping, _GROWTH)
        )
        left, found = xp.full_like(part, self.settings.max_iterations), self._is_enough(best, part)
        zero = xp.zeros_like(damping)
        return State(best, best.u, zero, damping, growth, part, left, found, found, iterations)

    def _next_part(self, state: State) -> State:
        best, part = state.best, state.part + 1
        seen = best._replace(model=self.objective.around(best.u, best.answer, part))
        stays = best.is_known & seen.is_known
        start = either(stays, lambda: seen, self.nothing._replace(u=best.u))
        return self._fresh(start, part, state.iterations)

    def _proposed(self, state: State) -> State:
        """State with its next trial point: the best point itself if it was not yet evaluated."""
        xp, best = namespace(state.trial), state.best
        moving = _moving(best, self.bounds, self._small(best, state.part))
        move = _move(best, state.damping, moving, self.bounds)
        move = xp.where(best.is_known, move, 0.0)
        predicted = best.model.decrease(move)
        return state._replace(trial=best.u + move, predicted=predicted)

    def _learned(self, state: State, trial: Point) -> State:
        xp, best, predicted = namespace(state.trial), state.best, state.predicted
        gained = best.model.cost - trial.model.cost
        accepted = trial.is_known & (gained > 0)
        ratio = gained / xp.where(predicted > 0, predicted, 1.0)
        easier = xp.maximum(1 / 3, 1 - (2 * ratio - 1) ** 3)
        damping = state.damping * xp.where(accepted, easier, state.growth)
        damping = xp.where(best.is_known, damping, state.damping)
        small = self._small(best, state.part)
        flat = (xp.abs(predicted) <= small) & (xp.where(accepted, gained, 0.0) <= small)
        lowest = either(accepted, lambda: trial, best)
        found = (best.is_known & flat) | self._is_enough(lowest, state.part)
        hopeless = (~best.is_known & ~accepted) | (damping > _TOO_MUCH) | (state.left == 1)
        return state._replace(
            best=lowest,
            damping=damping,
            growth=xp.where(accepted, _GROWTH, 2 * state.growth),
            left=state.left - 1,
            converged=found,
            done=found | hopeless,
            iterations=state.iterations + 1,
        )

    def _is_enough(self, best: Point, part: Count) -> Flag:
        """True if this part is not the last and is fitted well enough."""
        small = self._small(best, part)
        moving = _moving(best, self.bounds, small)
        step = best.model.step(_weights(best.model.curvature, moving), 0.0)
        return self._is_early(part) & best.is_known & (best.model.decrease(step) <= small)

    def _is_early(self, part: Count) -> Flag:
        return part < self.objective.reductions.shape[0] - 1

    def _small(self, best: Point, part: Count) -> Number:
        return self.objective.reductions[part] * best.model.cost


def _moving(best: Point, bounds: Bounds, small: Number) -> Mask:
    """Mask of the active parameters whose longest step would change the cost noticeably,
    (Jᵀ J)ᵢᵢ reachᵢ² > small, except those at the end of their range towards which the cost falls.
    """
    model, slope = best.model, best.model.gradient
    held = ((best.u <= bounds.low) & (slope > 0)) | ((best.u >= bounds.high) & (slope < 0))
    return bounds.active & (model.curvature * bounds.reach**2 > small) & ~held


def _move(best: Point, damping: Number, moving: Mask, bounds: Bounds) -> Vector:
    xp, model = namespace(best.u), best.model
    squares = _tied(model, _loosened(model, bounds, moving), moving)
    low, high = bounds.low - best.u, bounds.high - best.u
    move = model.step(_weights(squares, moving), damping)
    for _ in range(_PASSES):
        inside = (low <= move) & (move <= high)
        if is_known(inside) and inside.all():
            break
        moving = moving & inside
        held = xp.where(moving, 0.0, xp.clip(move, low, high))
        move = held + model.moved(held).step(_weights(squares, moving), damping)
    return xp.clip(move / xp.maximum(xp.max(xp.abs(move) / bounds.reach), 1.0), low, high)


def _tied(model: Linearisation, usual: Vector, moving: Mask) -> Vector:
    """The squared weights of a step: curvatures, and small shares of the strongest one."""
    xp = namespace(usual)
    tied = moving & xp.isfinite(usual)
    strongest = xp.max(xp.where(tied, model.curvature * usual**2, 0.0))
    return model.curvature + _TIE * strongest / usual**2


def _loosened(model: Linearisation, bounds: Bounds, moving: Mask) -> Vector:
    """The usual steps, infinite for a parameter without limits that began near zero by chance: one
    that would still go much farther alone, after a step that is bounded by them.
    """
    xp, usual = namespace(bounds.usual), bounds.usual
    left = model.gradient_after(_weights(_tied(model, usual, moving), moving), _SLIGHT)
    unlimited = xp.isfinite(usual) & ~xp.isfinite(bounds.reach)
    far = _LOOSE * xp.where(unlimited, usual, 0.0)
    farther = xp.abs(left) > model.curvature * far
    return xp.where(unlimited & farther, xp.inf, usual)


def _weights(squares: Vector, moving: Mask) -> Vector:
    xp = namespace(squares)
    return xp.where(moving, xp.sqrt(xp.where(moving, squares, 1.0)), 0.0)
