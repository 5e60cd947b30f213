"""Batching and lanes: vmap is the loop, and a lane's fate is its own."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from systems import CASES, TIMES
from tiers import mostly_thorough, thorough


def run(case, parameters):
    return ij.simulate(
        case.model(parameters), case.initial(parameters), TIMES, step=ij.TaylorStep(order=8)
    )


def lanes(case, count=5):
    return case.parameters * jnp.linspace(0.97, 1.03, count)[:, None]


@pytest.mark.parametrize(
    "name",
    mostly_thorough(
        [
            "pendulum, restitution",
            "pendulum, Kelvin-Voigt",
            "pendulum with dry friction, two stops",
            "bouncing ball",
        ],
        "pendulum, restitution",
    ),
)
def test_vmap_equals_loop(name):
    case = CASES[name]
    batch = jax.jit(jax.vmap(lambda p: run(case, p)))(lanes(case))
    single = jax.jit(lambda p: run(case, p))
    for i, parameters in enumerate(lanes(case)):
        alone = single(parameters)
        np.testing.assert_allclose(batch.position[i], alone.position, rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(batch.impacts.time[i], alone.impacts.time, rtol=1e-11)
        assert batch.impacts.count[i] == alone.impacts.count


@thorough
def test_nested_vmap_and_lane_order():
    case = CASES["pendulum, Kelvin-Voigt"]
    flat = lanes(case, 6)
    batched = jax.jit(jax.vmap(lambda p: run(case, p).position))
    once = batched(flat)
    nested = jax.jit(jax.vmap(jax.vmap(lambda p: run(case, p).position)))(flat.reshape(2, 3, -1))
    np.testing.assert_array_equal(nested.reshape(once.shape), once)
    order = np.array([3, 0, 5, 1, 4, 2])
    np.testing.assert_array_equal(batched(flat[order]), once[order])


@thorough
def test_derivatives_commute_with_vmap():
    case = CASES["pendulum, restitution"]

    def last(parameters):
        return run(case, parameters).position[-1]

    rows = lanes(case, 4)
    each = jax.jit(jax.vmap(jax.grad(last)))(rows)
    summed = jax.jit(jax.grad(lambda rows: jnp.sum(jax.vmap(last)(rows))))(rows)
    forward = jax.jit(jax.vmap(jax.jacfwd(last)))(rows)
    np.testing.assert_allclose(each, summed, rtol=1e-11)
    np.testing.assert_allclose(each, forward, rtol=1e-11)


def test_failing_lane_is_isolated_bitwise():
    case = CASES["pendulum, restitution"]
    batched = jax.jit(jax.vmap(lambda p: run(case, p)))
    good = lanes(case, 4)
    bad = good.at[2, 0].set(jnp.nan)
    before, after = batched(good), batched(bad)
    others = np.array([0, 1, 3])
    np.testing.assert_array_equal(before.position[others], after.position[others])
    assert jax.tree.map(lambda x: x[2], after.result) == ij.RESULTS.impossible_parameters
    assert jax.tree.map(lambda x: x[0], after.result) == ij.RESULTS.successful
    assert np.all(np.isnan(after.position[2]))


@thorough
def test_single_precision_impacts():
    case = CASES["pendulum, Kelvin-Voigt"]
    parameters = case.parameters.astype(jnp.float32)
    with jax.enable_x64(False):
        small = run(case, parameters)
    assert small.position.dtype == jnp.float32
    assert small.result == ij.RESULTS.successful
    large = run(case, case.parameters)
    assert small.impacts.count == large.impacts.count
    np.testing.assert_allclose(small.impacts.time, large.impacts.time, atol=2e-5)
    np.testing.assert_allclose(small.position, large.position, atol=2e-4)
