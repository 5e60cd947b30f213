"""Many searches at once."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from impactjax._fit.levenberg_marquardt import LevenbergMarquardt, Minimum, Vector, minimise
from impactjax._fit.problem import Answer, Problem
from impactjax._fit.system import handles
from impactjax._fit.transform import farthest_move

_EARLY = 1e-3  # relative decrease at which a part of the record is fitted well enough

Lanes = Float[Array, "lanes parameters"]
Active = Bool[Array, " parameters"]


@eqx.filter_jit
def search(
    problem: Problem,
    optimiser: LevenbergMarquardt,
    lanes: Lanes,
    active: Bool[Array, "lanes parameters"],
) -> Minimum[Answer]:
    """A minimum from each start; starts are in the optimiser's coordinates."""
    known = handles(problem.system)
    reach = jnp.array([farthest_move(known[name].allowed) for name in problem.names], lanes.dtype)
    parts = jnp.stack([problem.recording.first(share).valid for share in optimiser.horizons])
    reductions = jnp.full(len(parts), _EARLY, lanes.dtype).at[-1].set(optimiser.reduction)

    def one(u: Vector, on: Active) -> Minimum[Answer]:
        def fit_part(u: Vector, part: tuple[Array, Array]) -> tuple[Vector, Minimum[Answer]]:
            valid, reduction = part
            own = eqx.tree_at(lambda each: each.recording.valid, problem, valid)
            minimum = minimise(optimiser, own.expand, u, on, reach, reduction)
            return minimum.u, minimum

        _, minima = jax.lax.scan(fit_part, u, (parts, reductions))
        last = jax.tree.map(lambda x: x[-1], minima)
        return eqx.tree_at(lambda each: each.iterations, last, jnp.sum(minima.iterations))

    return jax.vmap(one)(lanes, active)


@eqx.filter_jit
def best_of(minima: Minimum[Answer]) -> Minimum[Answer]:
    """The lowest of several minima."""
    cost = minima.quadratic.cost
    best = jnp.argmin(jnp.where(jnp.isfinite(cost), cost, jnp.inf))
    return jax.tree.map(lambda x: x[best], minima)
