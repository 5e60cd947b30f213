"""Standard errors of a learned restitution as a function of speed."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._fit.learned import Learned
from impactjax._model.law import AbstractImpactLaw
from impactjax._parameter import as_parameter
from impactjax._refusal import check_kind
from impactjax._types import Numbers

_ABSENT = 1e-6  # relative size of a derivative that counts as rounding

Curve = Float[Array, " speeds"]


def restitution_band(learned: Learned, speeds: Numbers) -> tuple[Curve, Curve]:
    """Restitution of a learned law at some approach speeds, and its standard error there.

    The error is √(aᵀ C a), with the derivatives a of r(v) by all learned numbers and their
    covariance C from the Jacobian of the residuals and the `noise` model. It ignores that r cannot
    rise with speed. It is infinite outside the speeds of the impacts, and if the recording does not
    determine r(v). It does not include the bias of a law with too few nodes.

    **Arguments:**

    - `learned`: result of `learn`, with an impact law at the lower stop.
    - `speeds`: approach speeds, shape (speeds,) [m/s].

    **Raises** `ValueError` if there is no impact law at the lower stop.
    """
    check_kind("learned", learned, Learned, "learn(experiment)")
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
    """Standard errors of functions of the learned numbers, from their derivatives."""
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
