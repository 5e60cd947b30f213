"""How fast a small disturbance of the state moves: it bounds the steps for the derivatives' sake.

The motion itself need not show it: a mass at its equilibrium, or one that creeps in a stop, allows
steps of any length, over which the derivative by its start would be wrong by any amount.
"""

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from impactjax._model.base_motion import HarmonicMotion
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.step import Point
from impactjax._simulate.varying import alike
from impactjax._types import Scalar

_SQUARINGS = 8


def fastest_rate(automaton: Automaton, start: Point) -> Scalar:
    """The spectral radius of the Jacobian of the flow, or the frequency of the base [rad/s].

    The base counts however small its amplitude, by which there may be a derivative.
    """
    state, unravel = ravel_pytree(start.y)

    def rates(state: Array) -> Array:
        return ravel_pytree(automaton.flow(start.t, unravel(state), start.mode))[0]

    directions = alike(jnp.eye(state.size, dtype=state.dtype), state)
    jacobian = jax.vmap(lambda d: jax.jvp(rates, (state,), (d,))[1])(directions)
    fastest = _spectral_radius(jacobian)
    for base in _bases(automaton):
        fastest = jnp.maximum(fastest, jnp.abs(base.frequency))
    return fastest


def _spectral_radius(matrix: Float[Array, "n n"]) -> Scalar:
    """‖Aᵐ‖^(1/m) for a large m, which tends to it by Gelfand's formula; 0 if A is not finite."""
    tiny, logarithm = jnp.finfo(matrix.dtype).tiny, jnp.zeros((), matrix.dtype)
    power = jnp.where(jnp.all(jnp.isfinite(matrix)), matrix, 0.0)
    for _ in range(_SQUARINGS):
        size = jnp.maximum(jnp.max(jnp.abs(power)), tiny)
        power = power / size
        power = jnp.sum(power[:, :, None] * power[None], axis=1)
        logarithm = 2 * (logarithm + jnp.log(size))
    last = jnp.log(jnp.maximum(jnp.max(jnp.abs(power)), tiny))
    return jnp.exp((logarithm + last) / 2**_SQUARINGS)


def _bases(automaton: Automaton) -> list[HarmonicMotion]:
    def is_base(part: object) -> bool:
        return isinstance(part, HarmonicMotion)

    parts = jax.tree.leaves(automaton.model, is_leaf=is_base)
    return [part for part in parts if is_base(part)]
