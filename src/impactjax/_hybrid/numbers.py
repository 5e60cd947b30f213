"""The numbers of a tree as one array, and what is needed to scale them."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from impactjax._hybrid.system import State
from impactjax._hybrid.varying import alike
from impactjax._types import Scalar


def packed(tree: PyTree) -> Float[Array, " numbers"]:
    """All numbers of a tree, leaf by leaf."""
    return jnp.concatenate([jnp.ravel(leaf) for leaf in jax.tree.leaves(tree)])


def unpacked(numbers: Float[Array, " numbers"], like: State) -> State:
    """A tree like another one, made of the numbers in an array."""
    leaves, structure = jax.tree.flatten(like)
    parts = jnp.split(numbers, np.cumsum([leaf.size for leaf in leaves])[:-1])
    shaped = [part.reshape(leaf.shape) for part, leaf in zip(parts, leaves, strict=True)]
    return jax.tree.unflatten(structure, shaped)


def direction(place: PyTree) -> PyTree:
    """A fixed direction in which nothing is special, of about the size of each number."""
    leaves, structure = jax.tree.flatten(place)
    random = np.random.default_rng(0)

    def one(leaf: Array) -> Array:
        share = random.uniform(0.5, 1.5, leaf.shape) * random.choice([-1.0, 1.0], leaf.shape)
        return jnp.where(leaf == 0, 1.0, leaf) * share.astype(leaf.dtype)

    return jax.tree.unflatten(structure, [one(leaf) for leaf in leaves])


def time_scale(flow: Callable[[Scalar, State], State], t: Scalar, y: State) -> Scalar:
    """A time in which the state changes: the geometric mean of the least and the largest of the
    times |y′/y″| and √|y/y″| of all numbers, but at least a thousandth of the largest, since a rate
    that is zero up to rounding gives a time that means nothing; 1 if there is none.
    """
    rate = flow(t, y)
    t, y, rate = alike((t, y, rate), rate)
    _, bend = jax.jvp(flow, (t, y), (jnp.ones_like(t), rate))
    value, slope, second = packed(y), packed(rate), packed(bend)
    safe = jnp.where(second == 0, 1.0, second)
    times = jnp.stack([jnp.abs(slope / safe), jnp.sqrt(jnp.abs(value / safe))])
    usable = (second != 0) & (times > 0) & jnp.isfinite(times)
    least = jnp.min(jnp.where(usable, times, jnp.inf))
    most = jnp.max(jnp.where(usable, times, 0.0))
    found = jnp.maximum(jnp.sqrt(least) * jnp.sqrt(most), most / 1000)
    return jnp.where(jnp.any(usable), found, 1.0)
