"""Repetition of stroboscopic states: after how many periods of the force a motion repeats."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int

from impactjax._hybrid.numbers import packed
from impactjax._hybrid.system import State
from impactjax._known import AnyArray

Rows = Float[AnyArray, "lanes keep numbers"]


@eqx.filter_jit
def rows_of(states: State) -> Rows:
    """The states of each lane as rows of numbers."""
    return jax.vmap(jax.vmap(packed))(states)


def in_units(rows: Rows, sizes: Float[AnyArray, "..."]) -> Rows:
    """Rows in units of these sizes; a size of zero counts as one."""
    return rows / jnp.where(sizes > 0, sizes, 1.0)


@eqx.filter_jit
def periods_of(rows: Rows, repeats: ArrayLike) -> Int[Array, " lanes"]:
    """The least number of rows after which those of a lane repeat, at most half of them; 0 if they
    do not. Rows that differ by at most `repeats` are the same.
    """
    rows = jnp.asarray(rows)
    lags = range(1, rows.shape[1] // 2 + 1)
    later = [jnp.max(jnp.abs(rows[:, lag:] - rows[:, :-lag]), axis=(1, 2)) for lag in lags]
    same = jnp.stack(later, axis=1) <= repeats
    return jnp.where(jnp.any(same, axis=1), jnp.argmax(same, axis=1) + 1, 0).astype(jnp.int32)
