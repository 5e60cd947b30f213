"""A number that is held along a step, although it depends on time."""

import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array

_held = Primitive("held")
_held.def_impl(lambda value: value)
_held.def_abstract_eval(lambda value: value)
mlir.register_lowering(_held, lambda _, value: [value])
batching.defvectorized(_held)
ad.primitive_jvps[_held] = lambda primals, _: (_held.bind(*primals), jnp.zeros_like(*primals))


def held(value: Array) -> Array:
    """The same value; in a Taylor series, the value at the point of expansion, without derivative.

    Use it to choose the piece of a function that is smooth between known times. A step must end at
    the next of them.
    """
    return _held.bind(value)
