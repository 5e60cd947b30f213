"""Many searches at once."""

from collections.abc import Callable
from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from impactjax._fit.levenberg_marquardt import LevenbergMarquardt, Minimum, Vector, minimise
from impactjax._fit.problem import AbstractProblem, Answer
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
    known = problem.handles()
    reach = jnp.array([farthest_move(known[name].allowed) for name in problem.names], lanes.dtype)
    reductions = jnp.full(parts.shape[0], _EARLY, lanes.dtype).at[-1].set(optimiser.reduction)

    def one(start: Vector, on: Active) -> Minimum[Answer]:
        usual = _usual_moves(problem, start, reach)

        def fit_part(u: Vector, part: tuple[Array, Array]) -> tuple[Vector, Minimum[Answer]]:
            valid, reduction = part
            u = jnp.where(_slopes(problem, u) < _FLAT * _slopes(problem, start), start, u)
            minimum = minimise(
                optimiser, problem.over(valid).expand, u, on, reach, usual, reduction
            )
            return minimum.u, minimum

        _, minima = jax.lax.scan(fit_part, start, (parts, reductions))
        last = jax.tree.map(lambda x: x[-1], minima)
        return eqx.tree_at(lambda each: each.iterations, last, jnp.sum(minima.iterations))

    return jax.vmap(one)(lanes, active)


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
