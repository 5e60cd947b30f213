"""Many searches at once."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from impactjax._fit.levenberg_marquardt import LevenbergMarquardt, Minimum, minimise
from impactjax._fit.problem import Answer, Problem
from impactjax._fit.system import handles
from impactjax._fit.transform import farthest_move

Lanes = Float[Array, "lanes parameters"]


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
    return jax.vmap(lambda u, on: minimise(optimiser, problem.expand, u, on, reach))(lanes, active)


@eqx.filter_jit
def best_of(minima: Minimum[Answer]) -> Minimum[Answer]:
    """The lowest of several minima."""
    cost = minima.quadratic.cost
    best = jnp.argmin(jnp.where(jnp.isfinite(cost), cost, jnp.inf))
    return jax.tree.map(lambda x: x[best], minima)
