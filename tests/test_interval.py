"""Interval arithmetic: no value of a function lies outside its bounds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from impactjax._simulate.interval import Interval, bounds

FUNCTIONS = {
    "polynomial": lambda x, y: 3 * x**3 - 2 * x * y + y**2 - 1,
    "quotient": lambda x, y: (x - y) / (4 + x),
    "powers": lambda x, y: (x + 3) ** 0.3 * (y + 3) ** -1.7 + x**-2,
    "waves": lambda x, y: jnp.sin(5 * x + y) + jnp.cos(7 * y),
    "monotone": lambda x, y: jnp.exp(x) + jnp.log(y + 3) + jnp.tanh(x) - jnp.sqrt(x + 3),
    "distances": lambda x, y: jnp.abs(x) * jnp.maximum(x, y) + jnp.minimum(x, 0.5) + x * x,
    "branches": lambda x, y: jnp.where((x > y) & ~(x >= 1), x**2, jnp.where(x <= 0, y, -y)),
    "arrays": lambda x, y: jnp.stack([x, y, x * y]) @ jnp.array([1.0, -2.0, 0.5]),
    "clipped": lambda x, y: jnp.clip(x, -0.3, 0.4) + jnp.sum(jnp.square(jnp.stack([x, y]))),
    "steps": lambda x, y: jnp.floor(3 * x) + jnp.sign(y),
    "called": jax.jit(lambda x, y: x * y),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_interval_bounds_contain_all_values(name):
    function, random = FUNCTIONS[name], np.random.default_rng(3)

    @jax.jit
    @jax.vmap
    def bounded(box):
        return bounds(function, Interval(box[0], box[1]), Interval(box[2], box[3]))

    centre, half = random.uniform(-2, 2, (200, 2)), 10 ** random.uniform(-4, -0.1, (200, 2))
    low, high = centre - half, centre + half
    low[:20, 0] = high[:20, 0]  # some sides are points
    box = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
    found = bounded(box)
    share = random.uniform(0, 1, (2, 500, 1, 2))[0]
    points = low + share * (high - low)
    values = jax.vmap(jax.vmap(function))(points[..., 0], points[..., 1])
    defined = np.isfinite(values).all(axis=0)
    slack = 1e-12 * (1 + np.abs(values).max(axis=0))
    outside = (values < found.low - slack) | (values > found.high + slack)
    assert not np.any(outside[:, defined] & np.isfinite(found.width())[None, defined])
    assert np.mean(np.isfinite(found.width())[defined]) > 0.3  # and bounds there are


@pytest.mark.parametrize(
    ("low", "high", "least", "most"),
    [
        (1.5, 1.7, np.sin(1.7), 1.0),  # about the crest, symmetric or not
        (np.pi / 2 - 0.1, np.pi / 2 + 0.1, np.cos(0.1), 1.0),
        (4.6, 4.8, -1.0, np.sin(4.6)),
        (0.0, 7.0, -1.0, 1.0),
        (-0.2, 0.3, np.sin(-0.2), np.sin(0.3)),
    ],
)
def test_interval_bounds_of_sine_are_exact(low, high, least, most):
    found = bounds(jnp.sin, Interval(jnp.asarray(low), jnp.asarray(high)))
    np.testing.assert_allclose([found.low, found.high], [least, most], rtol=1e-12)


def test_primitive_without_rule_is_unbounded():
    found = bounds(jax.lax.lgamma, Interval(jnp.asarray(1.0), jnp.asarray(2.0)))
    assert found.low == -jnp.inf
    assert found.high == jnp.inf


def test_quotient_by_vanishing_divisor_is_unbounded():
    found = bounds(lambda x: 1 / x, Interval(jnp.asarray(-1.0), jnp.asarray(2.0)))
    assert found.low == -jnp.inf
    assert found.high == jnp.inf
