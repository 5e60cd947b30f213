"""The descent alone, on functions of which everything is known."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from impactjax._optimise.gradient_descent import History, begin, step


def descend(optimiser, cost, start, steps):
    none = jnp.zeros((), jnp.int32)
    history = History(jnp.full(steps, jnp.nan), none, none)
    state = begin(optimiser, jnp.asarray(start), jnp.asarray(1.0), history)
    one = jax.jit(functools.partial(step, optimiser, cost))
    while state.history.iterations < steps and not state.over:
        state = one(state)
    return state


@pytest.mark.parametrize("size", [2, 60])
def test_gradient_descent_minimises_rosenbrock(size):
    """In forward mode, and in reverse."""

    def cost(x):
        return jnp.sum(100 * (x[1::2] - x[::2] ** 2) ** 2 + (1 - x[::2]) ** 2)

    state = descend(optax.lbfgs(), cost, np.tile([-1.2, 1.0], size // 2), 100)
    assert state.over
    np.testing.assert_allclose(state.best, 1.0, atol=1e-6)


def test_non_finite_step_is_halved_and_counted():
    """x − ln x from 4 with steps of 6 x′ = −4.5: −0.5 has no logarithm, 1.75 has."""
    state = descend(optax.sgd(6.0), lambda x: jnp.sum(x - jnp.log(x)), [4.0], 3)
    assert state.history.refused == 1
    np.testing.assert_allclose(state.point, 1.75)
    expected = [4 - math.log(4)] * 2 + [1.75 - math.log(1.75)]
    np.testing.assert_allclose(state.history.costs, expected)


def test_gradient_descent_keeps_the_best_point():
    """A learning rate that is too large doubles the distance at every step."""
    state = descend(optax.sgd(3.0), lambda x: jnp.sum(x**2) / 2, [1.0], 5)
    np.testing.assert_allclose(state.point, 16.0)
    np.testing.assert_allclose(state.best, 1.0)
    np.testing.assert_allclose(state.lowest, 0.5)
