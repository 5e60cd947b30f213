"""Many searches at once."""

from collections.abc import Callable
from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PyTree

from impactjax._fit.levenberg_marquardt import LevenbergMarquardt
from impactjax._fit.minimiser import Bounds, Minimiser, Minimum, Objective, Vector
from impactjax._fit.problem import AbstractProblem, Answer
from impactjax._fit.queue import Iteration, in_turn
from impactjax._fit.transform import farthest_move

_EARLY = 1e-3  # relative decrease at which a part of the record is fitted well enough
_LEAST = 0.1  # usual move, relative to the farthest
_FLAT = 0.1  # slope, relative to that at the start, below which a parameter starts anew

Lanes = Float[Array, "lanes parameters"]
Active = Bool[Array, " parameters"]
Search: TypeAlias = Callable[..., Minimum[Answer]]  # `search`, or what stands for it


@eqx.filter_jit
def search(
    problem: AbstractProblem,
    optimiser: LevenbergMarquardt,
    lanes: Lanes,
    active: Bool[Array, "lanes parameters"],
    parts: Bool[Array, "parts observations"],
) -> Minimum[Answer]:
    """A minimum from each start, in the optimiser's coordinates, over one part of the observations
    after the other; the last part is the whole. What the others leave open stays near its start.
    """
    # Traced once, with what its ties close over.
    answered = eqx.filter_closure_convert(eqx.Partial(_answered), problem, lanes[0])
    arrays, other = eqx.partition((problem, parts, answered), eqx.is_array)

    def minimiser(arrays: PyTree, lane: tuple[Vector, Active]) -> Minimiser[Answer]:
        (problem, parts, answered), (start, on) = eqx.combine(arrays, other), lane
        objective = Objective(
            answer=lambda u: answered(problem, u),
            around=lambda u, answer, part: problem.around(u, answer, parts[part]),
            onwards=lambda u: _unstuck(problem, u, start),
            reductions=jnp.full(len(parts), _EARLY, lanes.dtype).at[-1].set(optimiser.reduction),
        )
        reach = _reach(problem, start)
        return Minimiser(
            optimiser, objective, Bounds(on, reach, _usual_moves(problem, start, reach))
        )

    iteration = Iteration(
        begin=lambda arrays, lane: minimiser(arrays, lane).begin(lane[0]),
        go_on=lambda arrays, lane, state: minimiser(arrays, lane).go_on(state),
        ended=lambda state: state.ended,
        result=lambda state: state.minimum,
    )
    return in_turn(iteration, arrays, (lanes, active))


def _answered(problem: AbstractProblem, u: Vector) -> Answer:
    return problem.answer(problem.values(u))


def _unstuck(problem: AbstractProblem, u: Vector, start: Vector) -> Vector:
    """Parameters that have come to the flat end of a range begin anew."""
    return jnp.where(_slopes(problem, u) < _FLAT * _slopes(problem, start), start, u)


def _reach(problem: AbstractProblem, start: Vector) -> Vector:
    known = problem.handles()
    return jnp.array([farthest_move(known[name].allowed) for name in problem.names], start.dtype)


def _slopes(problem: AbstractProblem, u: Vector) -> Vector:
    """Of the natural values: flat at the end of a range, which no search would leave again."""
    return jnp.abs(jax.jvp(problem.values, (u,), (jnp.ones_like(u),))[1])


def _usual_moves(problem: AbstractProblem, start: Vector, reach: Vector) -> Vector:
    """Moves that change each value by about as much as it is; infinite for one that starts at 0 and
    may be anything.
    """
    values, slopes = jax.jvp(problem.values, (start,), (jnp.ones_like(start),))
    moves = jnp.abs(values / jnp.where(slopes == 0, 1.0, slopes))
    anything = jnp.where(moves > 0, moves, jnp.inf)
    return jnp.where(jnp.isfinite(reach), jnp.clip(moves, _LEAST * reach, reach), anything)


@eqx.filter_jit
def best_of(minima: Minimum[Answer]) -> Minimum[Answer]:
    """The lowest of several minima."""
    cost = minima.quadratic.cost
    best = jnp.argmin(jnp.where(jnp.isfinite(cost), cost, jnp.inf))
    return jax.tree.map(lambda x: x[best], minima)
