"""Nonlinear least squares by Levenberg and Marquardt, an evaluation at a time."""

import dataclasses
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._fit.levenberg_marquardt import LevenbergMarquardt
from impactjax._types import Code, Flag, Scalar

_TIE = 0.001  # share of the strongest curvature in the damping of each parameter
_GROWTH = 2.0  # of the damping, when a step is refused for the first time
_TOO_MUCH, _LEAST_DAMPING = 1e12, 1e-12

T = TypeVar("T")
Vector = Float[Array, " parameters"]
Matrix = Float[Array, "parameters parameters"]
Part = Code  # number of a part of the observations


class Quadratic(eqx.Module):
    """The sum of squares around a point, in the optimiser's coordinates."""

    cost: Scalar  # Σ r² / 2
    gradient: Vector
    curvature: Matrix  # Gauss-Newton


class Objective(eqx.Module, Generic[T]):
    """What is minimised: over one part of the observations after the other, the last the whole.

    - `answer`: what a point says, which is expensive.
    - `around`: the sum of squares of a part around a point, from its answer, which is not.
    - `onwards`: where the search of the next part starts if that of the last one ends at a point.
    - `reductions`: of each part, relative decrease of the cost below which its minimum is found.
    """

    answer: Callable[[Vector], T]
    around: Callable[[Vector, T, Part], Quadratic]
    onwards: Callable[[Vector], Vector]
    reductions: Float[Array, " parts"]


class Bounds(NamedTuple):
    """What holds a search back.

    - `active`: which parameters may move at all.
    - `reach`: the farthest that each may move at once.
    - `usual`: the farthest that each may move where it is felt with others only; infinite for one
      that may do so anyway.
    """

    active: Bool[Array, " parameters"]
    reach: Vector
    usual: Vector


class Minimum(eqx.Module, Generic[T]):
    """Where a search ended."""

    u: Vector
    answer: T
    quadratic: Quadratic
    converged: Flag
    iterations: Int[Array, ""]


class _Best(eqx.Module, Generic[T]):
    """The lowest point so far, or where to begin: the cost is infinite where nothing is known."""

    u: Vector
    answer: T
    quadratic: Quadratic

    @property
    def begins(self) -> Flag:
        return ~jnp.isfinite(self.quadratic.cost)


class State(eqx.Module, Generic[T]):
    """Where a search is."""

    best: _Best[T]
    damping: Scalar
    growth: Scalar
    part: Part
    left: Int[Array, ""]  # evaluations, in this part
    converged: Flag
    ended: Flag
    iterations: Int[Array, ""]

    @property
    def minimum(self) -> Minimum[T]:
        """Where the search ends, if it has."""
        best = self.best
        return Minimum(best.u, best.answer, best.quadratic, self.converged, self.iterations)


@dataclasses.dataclass(frozen=True, eq=False)
class Minimiser(Generic[T]):
    """The search for a minimum, an evaluation at a time.

    It is found when the cost fell by less than the reduction asked for in the step just taken, as
    expected; that of a part is good enough when it would by a step of Gauss and Newton, unless it
    is the last one. A parameter that is not felt over its reach stays for the moment. A point whose
    cost is not finite is never accepted.
    """

    settings: LevenbergMarquardt
    objective: Objective[T]
    bounds: Bounds

    def begin(self, start: Vector) -> State[T]:
        """Before the first evaluation."""
        return self._fresh(_nothing(self.objective, start), jnp.int32(0), jnp.int32(0))

    def go_on(self, state: State[T]) -> State[T]:
        """After one evaluation more, and in the next part if that of the last one is over."""
        return jax.lax.while_loop(
            lambda state: state.ended & self._is_early(state.part),
            self._next_part,
            self._improved(state),
        )

    def _fresh(self, best: _Best[T], part: Part, iterations: Int[Array, ""]) -> State[T]:
        damping, growth = (
            jnp.full_like(best.u[0], each) for each in (self.settings.damping, _GROWTH)
        )
        left, found = jnp.int32(self.settings.max_iterations), self._is_good_enough(best, part)
        return State(best, damping, growth, part, left, found, found, iterations)

    def _next_part(self, state: State[T]) -> State[T]:
        part, u, answer = state.part + 1, self.objective.onwards(state.best.u), state.best.answer
        seen = _Best(u, answer, self.objective.around(u, answer, part))
        stays = jnp.all(u == state.best.u) & ~state.best.begins & ~seen.begins
        best = _either(stays, seen, _nothing(self.objective, u))
        return self._fresh(best, part, state.iterations)

    def _improved(self, state: State[T]) -> State[T]:
        best, small = state.best, self._small(state.best, state.part)
        moving = _moving(best.quadratic, self.bounds, small)
        move = _move(best.quadratic, state.damping, moving, self.bounds)
        u = best.u + jnp.where(best.begins, 0.0, move)
        answer = self.objective.answer(u)
        trial = _Best(u, answer, self.objective.around(u, answer, state.part))
        predicted = _predicted(best.quadratic, move)
        gained = best.quadratic.cost - trial.quadratic.cost
        accepted = ~trial.begins & (gained > 0)
        ratio = gained / jnp.where(predicted > 0, predicted, 1.0)
        easier = jnp.maximum(1 / 3, 1 - (2 * ratio - 1) ** 3)
        damping = state.damping * jnp.where(accepted, easier, state.growth)
        damping = jnp.where(best.begins, state.damping, damping)
        flat = (predicted <= small) & (jnp.where(accepted, gained, 0.0) <= small)
        lowest = _either(accepted, trial, best)
        found = (~best.begins & flat) | self._is_good_enough(lowest, state.part)
        hopeless = (best.begins & ~accepted) | (damping > _TOO_MUCH) | (state.left == 1)
        return State(
            lowest,
            damping,
            jnp.where(accepted, _GROWTH, 2 * state.growth),
            state.part,
            state.left - 1,
            found,
            found | hopeless,
            state.iterations + 1,
        )

    def _is_good_enough(self, best: _Best[T], part: Part) -> Flag:
        small = self._small(best, part)
        moving = _moving(best.quadratic, self.bounds, small)
        gain = _expected_gain(best.quadratic, moving)
        return self._is_early(part) & ~best.begins & (gain <= small)

    def _is_early(self, part: Part) -> Flag:
        return part < self.objective.reductions.shape[0] - 1

    def _small(self, best: _Best[T], part: Part) -> Scalar:
        return self.objective.reductions[part] * best.quadratic.cost


def _nothing(objective: Objective[T], start: Vector) -> _Best[T]:
    """A point of which nothing is known yet."""
    answer = jax.eval_shape(objective.answer, start)
    quadratic = jax.eval_shape(objective.around, start, answer, jnp.int32(0))
    answer, quadratic = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), (answer, quadratic))
    infinite = jnp.full_like(quadratic.cost, jnp.inf)
    return _Best(start, answer, eqx.tree_at(lambda each: each.cost, quadratic, infinite))


def _either(condition: Flag, yes: _Best[T], no: _Best[T]) -> _Best[T]:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def _moving(quadratic: Quadratic, bounds: Bounds, small: Scalar) -> Bool[Array, " parameters"]:
    """Which parameters are felt over their reach."""
    return bounds.active & (jnp.diagonal(quadratic.curvature) * bounds.reach**2 > small)


def _move(quadratic: Quadratic, damping: Scalar, moving: Array, bounds: Bounds) -> Vector:
    diagonal, usual = jnp.diagonal(quadratic.curvature), bounds.usual
    tied = moving & jnp.isfinite(usual)
    strongest = jnp.max(jnp.where(tied, diagonal * usual**2, 0.0))
    scale = diagonal + _TIE * strongest / usual**2
    move = -_damped(quadratic, moving, scale, damping)
    return move / jnp.maximum(jnp.max(jnp.abs(move) / bounds.reach), 1.0)


def _damped(quadratic: Quadratic, moving: Array, scale: Vector, damping: Scalar | float) -> Vector:
    """(H + λ S)⁻¹ g over the parameters that move, with the diagonal S."""
    root = jnp.sqrt(jnp.where(scale > 0, scale, 1.0))
    both = moving[:, None] & moving[None, :]
    unit = jnp.eye(scale.shape[0], dtype=scale.dtype)
    scaled = jnp.where(both, quadratic.curvature / (root[:, None] * root[None, :]), unit)
    gradient = jnp.where(moving, quadratic.gradient / root, 0.0)
    return jnp.linalg.solve(scaled + damping * unit, gradient) / root


def _predicted(quadratic: Quadratic, move: Vector) -> Scalar:
    return -(quadratic.gradient @ move) - move @ quadratic.curvature @ move / 2


def _expected_gain(quadratic: Quadratic, moving: Array) -> Scalar:
    """What a step of Gauss and Newton would gain, gᵀ H⁻¹ g / 2."""
    scale = jnp.diagonal(quadratic.curvature)
    return quadratic.gradient @ _damped(quadratic, moving, scale, _LEAST_DAMPING) / 2
