"""From where to search."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._fit.problem import Problem
from impactjax._fit.system import handles

_CONTACT_SPREAD, _OTHER_SPREAD = 1.0, 0.02
_INSIDE = 0.02  # of a range: at its very end nothing is felt


class Starts(eqx.Module):
    """Where searches start: the model's own values, and values scattered around them.

    Parameters of the contact, whose first estimates are the least certain, are scattered by factors
    up to e, the others by 2 %.

    **Arguments:**

    - `count`: how many searches; the first one starts at the model's own values.
    - `seed`: of the scatter.
    """

    count: int = eqx.field(default=16, static=True)
    seed: int = eqx.field(default=0, static=True)

    def __check_init__(self) -> None:
        if self.count < 1:
            raise ValueError(f"Argument `count` must be at least 1, but it is {self.count}.")

    @eqx.filter_jit
    def lanes(self, problem: Problem) -> Float[Array, "lanes parameters"]:
        """The starts in the optimiser's coordinates."""
        known = handles(problem.system)
        key = jax.random.key(self.seed)
        columns = []
        for i, name in enumerate(problem.names):
            value = known[name].get(problem.system)
            of_contact = "law" in known[name].path
            spread = _CONTACT_SPREAD if of_contact else _OTHER_SPREAD
            scatter = jax.random.uniform(
                jax.random.fold_in(key, i), (self.count,), value.dtype, -spread, spread
            )
            low, high = known[name].allowed.low, known[name].allowed.high
            inside = _INSIDE * (high - low) if math.isfinite(high - low) else 0.0
            values = jnp.clip(value * jnp.exp(scatter), low + inside, high - inside)
            columns.append(values.at[0].set(jnp.clip(value, low, high)))
        return problem.unbounded(jnp.stack(columns, axis=1))
