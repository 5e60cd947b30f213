"""Nonlinear least squares by Levenberg and Marquardt, as a function that `jit` and `vmap` take."""

import itertools
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._types import Flag, Scalar

_TIE = 0.001  # share of the strongest curvature in the damping of each parameter

T = TypeVar("T")
Vector = Float[Array, " parameters"]
Matrix = Float[Array, "parameters parameters"]


class LevenbergMarquardt(eqx.Module):
    """The optimiser's settings.

    **Arguments:**

    - `max_iterations`: evaluations of residuals and Jacobian.
    - `reduction`: relative decrease of the sum of squares below which it has converged.
    - `damping`: first damping, relative to the curvature.
    - `horizons`: parts of the record, as fractions of it, that are fitted one after the other, each
      from where the last one ended; the last is the whole. Over a short time a motion far from the
      recorded one has not yet lost its phase: a search from afar ends at the right minimum.
    """

    max_iterations: int = eqx.field(default=150, static=True)
    reduction: float = eqx.field(default=1e-8, static=True)
    damping: float = eqx.field(default=1e-3, static=True)
    horizons: tuple[float, ...] = eqx.field(default=(0.25, 0.5, 1.0), static=True)

    def __check_init__(self) -> None:
        if self.max_iterations < 1:
            raise ValueError(
                f"Argument `max_iterations` must be at least 1, but it is {self.max_iterations}."
            )
        rising = all(a < b for a, b in itertools.pairwise((0.0, *self.horizons)))
        if not (rising and self.horizons and self.horizons[-1] == 1):
            raise ValueError(
                "Argument `horizons` must rise from above 0 to 1, such as (0.25, 0.5, 1.0), but it "
                f"is {self.horizons}."
            )


class Quadratic(eqx.Module, Generic[T]):
    """The sum of squares around a point, in the optimiser's coordinates."""

    cost: Scalar  # Σ r² / 2
    gradient: Vector
    curvature: Matrix  # Gauss-Newton
    information: Matrix  # the curvature in natural units
    answer: T  # whatever else was found on the way


class Minimum(eqx.Module, Generic[T]):
    """Where a run ended."""

    u: Vector
    quadratic: Quadratic[T]
    converged: Flag
    iterations: Int[Array, ""]


class _State(NamedTuple):
    best: Minimum
    damping: Scalar
    growth: Scalar
    done: Flag


def minimise(
    settings: LevenbergMarquardt,
    expand: Callable[[Vector], Quadratic],
    start: Vector,
    active: Bool[Array, " parameters"],
    reach: Vector,
    usual: Vector,
    reduction: Scalar,
) -> Minimum:
    """The minimum near `start` over the parameters that are `active`; the others stay.

    It is found when the cost falls by less than `reduction`, relative.

    No parameter moves farther than its `reach` at once, and one that is not felt over its reach
    stays for the moment. Where only several together are felt, none moves much farther than is
    `usual`, unless that is infinite. A point whose cost is not finite is never accepted.
    """

    @jax.jit  # so that it is traced once
    def expanded(u: Vector) -> Quadratic:
        return expand(u)

    zeros = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(expanded, start))
    nothing = eqx.tree_at(lambda quadratic: quadratic.cost, zeros, jnp.full_like(start[0], jnp.inf))
    first = _State(
        Minimum(start, nothing, jnp.zeros((), bool), jnp.int32(0)),
        jnp.full_like(start[0], settings.damping),
        jnp.full_like(start[0], 2.0),
        jnp.zeros((), bool),
    )

    def unfinished(state: _State) -> Flag:
        return ~state.done & (state.best.iterations < settings.max_iterations)

    def improve(state: _State) -> _State:
        best = state.best
        begins = best.iterations == 0
        felt = jnp.diagonal(best.quadratic.curvature) * reach**2
        moving = active & (felt > reduction * best.quadratic.cost)
        move = jnp.where(begins, 0.0, _move(best.quadratic, state.damping, moving, reach, usual))
        trial = expanded(best.u + move)
        predicted = _predicted(best.quadratic, move)
        gained = best.quadratic.cost - trial.cost
        accepted = jnp.isfinite(trial.cost) & (gained > 0)
        ratio = gained / jnp.where(predicted > 0, predicted, 1.0)
        easier = jnp.maximum(1 / 3, 1 - (2 * ratio - 1) ** 3)
        small = reduction * best.quadratic.cost
        flat = ~begins & (predicted <= small) & (jnp.where(accepted, gained, 0.0) <= small)
        chosen = jax.tree.map(
            lambda new, old: jnp.where(accepted, new, old),
            (best.u + move, trial),
            (best.u, best.quadratic),
        )
        hopeless = begins & ~accepted
        stuck = hopeless | (state.damping > 1e12)
        return _State(
            Minimum(chosen[0], chosen[1], flat | best.converged, best.iterations + 1),
            state.damping * jnp.where(begins, 1.0, jnp.where(accepted, easier, state.growth)),
            jnp.where(accepted, 2.0, 2 * state.growth),
            flat | stuck,
        )

    return jax.lax.while_loop(unfinished, improve, first).best


def _move(
    quadratic: Quadratic, damping: Scalar, active: Array, reach: Vector, usual: Vector
) -> Vector:
    diagonal = jnp.diagonal(quadratic.curvature)
    known = active & jnp.isfinite(usual)
    strongest = jnp.max(jnp.where(known, diagonal * usual**2, 0.0))
    scale = diagonal + _TIE * strongest / usual**2
    root = jnp.sqrt(jnp.where(scale > 0, scale, 1.0))
    both = active[:, None] & active[None, :]
    unit = jnp.eye(scale.shape[0], dtype=scale.dtype)
    scaled = jnp.where(both, quadratic.curvature / (root[:, None] * root[None, :]), unit)
    gradient = jnp.where(active, quadratic.gradient / root, 0.0)
    move = -jnp.linalg.solve(scaled + damping * unit, gradient) / root
    return move / jnp.maximum(jnp.max(jnp.abs(move) / reach), 1.0)


def _predicted(quadratic: Quadratic, move: Vector) -> Scalar:
    return -(quadratic.gradient @ move) - move @ quadratic.curvature @ move / 2
