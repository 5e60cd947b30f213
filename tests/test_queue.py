"""Iterations of different lengths in one batch, against the same ones in plain Python."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from impactjax._optimise.lane_queue import Iteration, in_turn

# Steps of 3 n + b or n / 2 until n is 1 or there were many: from 1 to 100 of them for b = 1.

MANY = 100
COLLATZ = Iteration(
    init=lambda b, n: (n, jnp.zeros_like(n)),
    step=lambda b, n, state: (
        jnp.where(state[0] % 2 == 0, state[0] // 2, 3 * state[0] + b),
        state[1] + 1,
    ),
    done=lambda state: (state[0] == 1) | (state[1] == MANY),
    result=lambda state: {"last": state[0], "steps": state[1][None]},
)


def expected(b, starts):
    steps = []
    for start in starts:
        n, count = start, 0
        while True:
            n, count = (n // 2 if n % 2 == 0 else 3 * n + b), count + 1
            if n == 1 or count == MANY:
                break
        steps.append(count)
    return np.array(steps)


@pytest.mark.parametrize("count", [1, 7, 8, 9, 100, 300])
def test_lanes_end_independently(count):
    starts = np.arange(1, count + 1)
    found = jax.jit(lambda n: in_turn(COLLATZ, jnp.int32(1), n))(jnp.asarray(starts, jnp.int32))
    np.testing.assert_array_equal(found["steps"][:, 0], expected(1, starts))
    assert np.ptp(found["steps"]) > 50 or count < 27


STARTS = np.random.default_rng(0).integers(2, 500, (5, 3, 6))
ADDED = np.array([[1, 5, 7]] * 5) + 2 * np.arange(5)[:, None]


@pytest.mark.parametrize("axes", [(0, 0), (None, 0), (0, None)])
def test_batch_members_share_one_queue(axes):
    """Two nested batches over data, lanes or both."""
    over_data, over_lanes = axes
    b, n = jnp.asarray(ADDED, jnp.int32), jnp.asarray(STARTS, jnp.int32)
    b, n = (b if over_data == 0 else b[0, 0]), (n if over_lanes == 0 else n[0, 0])
    once = jax.vmap(lambda b, n: in_turn(COLLATZ, b, n), axes)
    found = jax.jit(jax.vmap(once, axes))(b, n)["steps"][..., 0]
    for i, j in np.ndindex(5, 3):
        own = ADDED[i, j] if over_data == 0 else ADDED[0, 0]
        starts = STARTS[i, j] if over_lanes == 0 else STARTS[0, 0]
        np.testing.assert_array_equal(found[i, j], expected(own, starts))


# Heron's iteration for the square root of b, from different places.

HERON = Iteration(
    init=lambda b, start: (start, jnp.zeros((), jnp.int32)),
    step=lambda b, start, state: ((state[0] + b / state[0]) / 2, state[1] + 1),
    done=lambda state: state[1] == 60,
    result=lambda state: state[0],
)


def test_queue_derivatives_are_those_of_the_iteration():
    def root(b):
        return in_turn(HERON, b, jnp.linspace(0.1, 50.0, 20))

    b = jnp.array([0.5, 2.0, 7.0])
    found = jax.vmap(jax.jacfwd(root))(b)
    np.testing.assert_allclose(found, np.outer(0.5 / np.sqrt(b), np.ones(20)), rtol=1e-12)
