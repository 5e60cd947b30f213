"""One impact on a law F = k δⁿ (1 + c δ′), whose equation of motion separates.

From m v dv/(1 + c v) = −k δⁿ dδ follows, with Z = c v⁻, ψ and z(s) of `lambert.py` and
S = Z √(2 ψ(Z)), so that z(S) = Z:

    r = −z(−S)/Z,        k δₘⁿ⁺¹ = (n + 1) ψ(Z) m v⁻²,
    T = m v⁻ √(2 ψ(Z)) / (k δₘⁿ) ∫ (1 − x²)^(−n/(n+1)) S x/z(S x) dx over −1 < x < 1,

and the force is largest where (n + 1) (ψ(Z) Z² − ψ(z) z²) = n z. The restitution r depends on Z
alone, so it does not depend on k.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from impactjax._model.equivalents import Equivalents, approach, equivalents
from impactjax._model.lambert import psi, z_over_s
from impactjax._model.power import Coefficient
from impactjax._model.root import root
from impactjax._parameter import as_parameter
from impactjax._types import Force, InverseSpeed, Mass, Numbers, Ratio, Speed

_SPACING, _REACH = 1 / 24, 132  # tanh-sinh rule: T to 1e-12 for Z up to 50, n up to 9


def separable_equivalents(
    k: Coefficient, c: InverseSpeed, n: ArrayLike, speed: Numbers, mass: Numbers
) -> Equivalents:
    """Equivalents of an impact on F = k δⁿ (1 + c δ′)."""
    return _equivalents(k, c, as_parameter(n), *approach(speed, mass))


@jax.jit
def _equivalents(k: Coefficient, c: InverseSpeed, n: Ratio, v: Speed, m: Mass) -> Equivalents:
    z = c * v
    energy = 2 * psi(z)  # energy stored at greatest compression, relative to that for c = 0
    deepest = ((n + 1) * m * v**2 * energy / (2 * k)) ** (1 / (n + 1))
    duration = m * v * jnp.sqrt(energy) / (k * deepest**n) * _passage(z * jnp.sqrt(energy), n)
    peak = _peak(k, z, n, v, m)
    return equivalents(v, m, separable_restitution(z), duration, deepest, peak)


def separable_restitution(z: Ratio) -> Ratio:
    """Coefficient of restitution r(Z)."""
    root_energy = jnp.sqrt(2 * psi(z))
    return root_energy * z_over_s(-z * root_energy)


def restitution_damping(r: ArrayLike, speed: ArrayLike) -> InverseSpeed:
    """The c that gives a coefficient of restitution r at a speed [m/s]."""
    return _impact_number(as_parameter(r)) / as_parameter(speed)


@jax.jit
def _impact_number(r: Ratio) -> Ratio:
    """The Z = c v that gives a coefficient of restitution r."""
    return root(_inverse_residual, 1.5 * (1 - r), r)


def _inverse_residual(z: Ratio, r: Ratio) -> Ratio:
    return 1 / separable_restitution(z) - 1 / r


def _peak(k: Coefficient, z: Ratio, n: Ratio, v: Speed, m: Mass) -> Force:
    """The largest force. Its condition is solved for η = z/Z², without loss of digits at Z = 0."""
    half = psi(z)
    share = root(_peak_residual, (n + 1) * half / n, (z, half, n))
    return k * (n * m * v**2 * share / k) ** (n / (n + 1)) * (1 + z**2 * share)


def _peak_residual(share: Ratio, parameters: tuple[Ratio, Ratio, Ratio]) -> Ratio:
    z, half, n = parameters
    return n * share + (n + 1) * ((z * share) ** 2 * psi(z**2 * share) - half)


def _passage(s: Ratio, n: Ratio) -> Ratio:
    """Integral ∫ (1 − x²)^(−n/(n+1)) s x/z(s x) dx over −1 < x < 1, by the tanh-sinh rule.

    Source: H. Takahasi and M. Mori (1974), "Double exponential formulas for numerical integration",
    Publications of RIMS 9, 721.
    """
    x, log_of_complement, weight = (jnp.asarray(each, s.dtype) for each in _tanh_sinh())
    density = weight * jnp.exp(log_of_complement / (n[..., None] + 1))
    return jnp.sum(density / z_over_s(s[..., None] * x), axis=-1)


@functools.cache
def _tanh_sinh() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes x, ln(1 − x²), and the weights of an integral of f(x)/(1 − x²)."""
    t = _SPACING * np.arange(-_REACH, _REACH + 1)
    u = np.pi / 2 * np.sinh(t)
    log_cosh = np.abs(u) + np.log1p(np.exp(-2 * np.abs(u))) - np.log(2)
    return np.tanh(u), -2 * log_cosh, _SPACING * np.pi / 2 * np.cosh(t)
