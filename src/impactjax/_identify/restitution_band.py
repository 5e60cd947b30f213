"""How well a learned restitution is known, speed by speed."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from impactjax._fit.learned import Learned
from impactjax._model.law import AbstractImpactLaw
from impactjax._parameter import as_parameter

_ABSENT = 1e-6  # of a derivative: rounding

Curve = Float[Array, " speeds"]


def restitution_band(learned: Learned, speeds: ArrayLike) -> tuple[Curve, Curve]:
    """Restitution of a learned law at some approach speeds, and its standard error there.

    The error is √(aᵀ C a), with a the derivatives of r(v) by all that was learned and C their
    covariance from the Jacobian of the residuals and what `noise` assumes of them. It does not know
    that r must not rise, and is infinite outside the speeds of the impacts, and where nothing in
    the recording tells what was learned. That the law has too few speeds to follow the truth it
    cannot tell.

    **Arguments:**

    - `learned`: what `learn` found, with an impact law at the lower stop.
    - `speeds`: shape (speeds,) [m/s].

    **Raises** `ValueError` if there is no impact law at the lower stop.
    """
    stop = learned.task.problem.system.model.lower
    if stop is None or not isinstance(stop.law, AbstractImpactLaw):
        raise ValueError("Argument `learned` must have an impact law at its lower stop.")
    return _band(learned, as_parameter(speeds))


@eqx.filter_jit
def _band(learned: Learned, speeds: Curve) -> tuple[Curve, Curve]:
    def restitution(numbers: Array) -> tuple[Curve, Curve]:
        stop = learned.task.system(numbers).model.lower
        assert stop is not None
        assert isinstance(stop.law, AbstractImpactLaw)
        found = stop.law.restitution(speeds) * jnp.ones_like(speeds)
        return found, found

    slopes, middle = jax.jacfwd(restitution, has_aux=True)(learned.numbers)
    log = learned.impacts
    slowest = jnp.min(jnp.where(log.happened, log.approach_speed, jnp.inf))
    fastest = jnp.max(jnp.where(log.happened, log.approach_speed, -jnp.inf))
    seen = (speeds >= slowest) & (speeds <= fastest)
    return middle, jnp.where(seen, _errors(learned, slopes), jnp.inf)


def _errors(learned: Learned, slopes: Float[Array, "speeds numbers"]) -> Curve:
    """Standard errors of what depends by some slopes on what was learned."""
    problem = learned.task.problem
    root = jnp.sqrt(problem.loss.weight(learned.residuals))
    jacobian, residuals = root[:, None] * learned.jacobian, root * learned.residuals
    sizes = jnp.linalg.norm(jacobian, axis=0)
    scale = jnp.where(sizes > 0, sizes, 1.0)
    directions, strengths, rows = jnp.linalg.svd(jacobian / scale, full_matrices=False)
    least = max(jacobian.shape) * jnp.finfo(strengths.dtype).eps * jnp.max(strengths)
    told = strengths > least
    n = problem.recording.observations.astype(scale.dtype)
    p = jnp.sum(told, dtype=scale.dtype)
    known = problem.system.sensor.variance()
    spread = problem.noise.spread(residuals, n, directions) * n / jnp.maximum(n - p, 1.0)
    if known is not None:
        spread = known * jnp.eye(strengths.size)
    along = slopes / scale @ rows.T
    parts = jnp.where(told, along / jnp.where(told, strengths, 1.0), 0.0)
    lengths = jnp.linalg.norm(slopes / scale, axis=1)
    beyond = jnp.linalg.norm(slopes / scale - jnp.where(told, along, 0.0) @ rows, axis=1)
    errors = jnp.sqrt(jnp.sum((parts @ spread) * parts, axis=1))
    return jnp.where(beyond > _ABSENT * lengths, jnp.inf, errors)
