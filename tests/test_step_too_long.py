"""A Runge-Kutta step that is much too long for a flow that an event has made fast."""

import jax.numpy as jnp
import numpy as np

import impactjax as ij

FAST = 1e4


class Quenched(ij.HybridSystem):
    """x′ = −1 down to x = 1, and x′ = −k (x + x³) from there on."""

    def flow(self, t, y, mode):
        fast = -FAST * (y["x"] + y["x"] ** 3)
        return {"x": jnp.where(mode == 0, -jnp.ones_like(fast), fast)}

    def transitions(self):
        return [ij.Transition(self.falls, lambda t, y, mode: (y, jnp.ones_like(mode)))]

    def falls(self, t, y, mode):
        return jnp.where(mode == 0, y["x"] - 1, jnp.ones_like(y["x"]))


def test_step_whose_stages_overflow_is_repeated():
    """The square u of x obeys u / (1 + u) = exp(−2 k t) / 2 after the event."""
    later = np.array([1e-5, 1e-4, 5e-4])
    start = ij.Start(0.0, {"x": 1000.0}, 0)
    found = ij.solve(Quenched(), start, 999 + later, step=ij.RungeKutta())
    share = np.exp(-2 * FAST * later) / 2
    assert found.result == ij.RESULTS.successful
    np.testing.assert_allclose(found.ys["x"], np.sqrt(share / (1 - share)), rtol=1e-6)
