"""One impact on a linear spring and dashpot, in terms of the damping ratio γ during contact.

With φ = arccos γ the solution is a damped oscillation, and each derivative shifts its phase by
π − φ. Events at a phase that is a multiple of φ exist for γ ≥ 1 too; their times follow from
A(γ) = arccos γ/√(1 − γ²) = arcosh γ/√(γ² − 1), which is smooth at γ = 1.
"""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Float

from impactjax._known import AnyArray, namespace
from impactjax._model.root import root
from impactjax._types import Ratio

_TERMS = [math.comb(2 * k, k) / (4**k * (2 * k + 1)) for k in range(18)]  # of arcsin(√x)/√x


def arc_ratio(gamma: Ratio) -> Ratio:
    """A(γ) = arccos γ/√(1 − γ²), for all γ ≥ 0."""
    x = 1 - gamma**2
    near = jnp.abs(x) < 0.1
    small = jnp.where(near, x, 0)
    series = jnp.full_like(small, _TERMS[-1])
    for term in _TERMS[-2::-1]:
        series = series * small + term
    creeps = gamma > 1
    under, over = jnp.where(near | creeps, 0, gamma), jnp.where(creeps & ~near, gamma, 2)
    oscillating = jnp.arccos(under) / jnp.sqrt(1 - under**2)
    creeping = jnp.arccosh(over) / jnp.sqrt(over**2 - 1)
    return jnp.where(near, series, jnp.where(creeps, creeping, oscillating))


def half_turn(gamma: Ratio) -> Ratio:
    """Duration of half an oscillation times ω0: π/√(1 − γ²); infinite for γ ≥ 1."""
    creeps = gamma >= 1
    return jnp.where(creeps, math.inf, math.pi / jnp.sqrt(1 - jnp.where(creeps, 0, gamma) ** 2))


def decay(gamma: Ratio, duration: Ratio) -> Ratio:
    """exp(−γ τ) after a duration τ in units of 1/ω0, which may be infinite."""
    endless = duration == math.inf
    return jnp.where(endless, 0, jnp.exp(-gamma * jnp.where(endless, 0, duration)))


def damping_ratio(r: Float[AnyArray, "..."]) -> Float[AnyArray, "..."]:
    """γ = −ln r/√(π² + ln² r), the inverse of r = exp(−π γ/√(1 − γ²)) (3.43); 1 for r = 0."""
    xp = namespace(r)
    comes_back = r != 0
    loss = xp.log(xp.where(comes_back, r, 1.0))
    return xp.where(comes_back, -loss / xp.sqrt(math.pi**2 + loss**2), 1.0)


@jax.jit
def damping_ratio_without_pull(r: Ratio) -> Ratio:
    """The inverse of r = exp(−2 γ A(γ))."""
    loss = -jnp.log(r)
    return root(_loss_residual, loss / math.pi, loss)


def _loss_residual(gamma: Ratio, loss: Ratio) -> Ratio:
    return 2 * gamma * arc_ratio(gamma) - loss
