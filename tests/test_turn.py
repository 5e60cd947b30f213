"""Value of a function where it turns: its derivatives are those of the turn's height."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from impactjax._model.root import at_turn

MODES = {"forward": jax.jacfwd, "reverse": jax.jacrev}


def level(x, p):
    return p * x - x**4 / 4


def turn(p):
    """The top of p x − x⁴ / 4, at x = p^{1/3}: 3/4 p^{4/3}."""
    found = jax.lax.stop_gradient(jnp.cbrt(p))
    return at_turn(level, lambda x, p: p - x**3, found, p)


@pytest.mark.parametrize("order", ["forward forward", "forward reverse", "reverse reverse"])
def test_derivatives_of_the_height_of_a_turn(order):
    p = jnp.array(2.0)
    first, second = (MODES[name] for name in order.split())
    np.testing.assert_allclose(turn(p), 0.75 * p ** (4 / 3), rtol=1e-15)
    np.testing.assert_allclose(first(turn)(p), p ** (1 / 3), rtol=1e-14)
    twice, third = second(first(turn)), first(second(first(turn)))
    np.testing.assert_allclose(twice(p), p ** (-2 / 3) / 3, rtol=1e-14)
    np.testing.assert_allclose(third(p), -2 / 9 * p ** (-5 / 3), rtol=1e-13)
