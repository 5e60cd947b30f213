"""Values with derivatives of what turns, and how right they are."""

import jax
import numpy as np

import impactjax as ij

SERIES = ij.TaylorStep(order=8)  # compiles in a third of the time of order 15


def both_ways(function):
    """Values with their forward and reverse derivatives, lane by lane."""

    def with_value(p):
        value = function(p)
        return value, value

    forward = jax.jit(jax.vmap(jax.jacfwd(with_value, has_aux=True)))
    reverse = jax.jit(jax.vmap(jax.jacrev(function)))

    def every(lanes):
        slopes, values = forward(lanes)
        return values, slopes, reverse(lanes)

    return every


def check(found, values, slopes, rtol):
    """Values, and derivatives beside the largest one of their lane."""
    value, *derivatives = (np.asarray(each) for each in found)
    np.testing.assert_allclose(value, values, rtol=rtol)
    largest = np.max(np.abs(slopes), axis=-1, keepdims=True)
    for derivative in derivatives:
        assert np.all(np.isfinite(derivative))
        assert np.max(np.abs(derivative - slopes) / largest) < rtol
