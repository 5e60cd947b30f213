"""The function z(s) with z − ln(1 + z) = s²/2 and the sign of s.

It combines the real branches of Lambert's W, z = −1 − W(−exp(−1 − s²/2)) with W₋₁ for s > 0 and W₀
for s < 0. Unlike W, which loses half its digits where the branches meet, it is smooth there. With
l = ln(1 + z) its equation reads eˡ − 1 − l = s²/2, that is l² φ₂(l) = s²/2.
"""

import math

import jax.numpy as jnp

from impactjax._model.root import root
from impactjax._types import Ratio

_TERMS = [1 / math.factorial(k + 2) for k in range(18)]


def phi2(x: Ratio) -> Ratio:
    """φ₂(x) = (eˣ − 1 − x)/x², without cancellation around zero."""
    near = jnp.abs(x) < 1
    small, large = jnp.where(near, x, 0), jnp.where(near, 1, x)
    series = jnp.full_like(small, _TERMS[-1])
    for term in _TERMS[-2::-1]:
        series = series * small + term
    return jnp.where(near, series, (jnp.expm1(large) - large) / large**2)


def phi1(x: Ratio) -> Ratio:
    """φ₁(x) = (eˣ − 1)/x, which is 1 at zero."""
    near = jnp.abs(x) < 1
    small, large = jnp.where(near, x, 0), jnp.where(near, 1, x)
    return jnp.where(near, 1 + small * phi2(small), jnp.expm1(large) / large)


def psi(z: Ratio) -> Ratio:
    """ψ(z) = (z − ln(1 + z))/z², without cancellation around zero."""
    log = jnp.log1p(z)
    return phi2(log) / phi1(log) ** 2


def z_over_s(s: Ratio) -> Ratio:
    """z(s)/s, which is 1 at s = 0."""
    positive = jnp.where(s > 0, s, 1)
    start = jnp.where(s > 0, jnp.log1p(s + s**2 / 2) / positive, 1 - s / 2)
    log_over_s = root(_residual, start, s)
    return log_over_s * phi1(s * log_over_s)


def _residual(log_over_s: Ratio, s: Ratio) -> Ratio:
    return log_over_s**2 * phi2(s * log_over_s) - 1 / 2
