"""Several contacts at one time, and the step that a system of many operations takes."""

from functools import partial

import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

import impactjax as ij
from impactjax._hybrid.default_step import default_step
from impactjax._hybrid.ends import as_start
from impactjax._hybrid.equations import Equations
from impactjax._hybrid.explicit_step import ExplicitStep
from impactjax._hybrid.series_step import SeriesStep


class Cradle(ij.AbstractMechanism):
    """Balls on a line with linear springs between them."""

    law: ij.KelvinVoigt
    count: int

    def mass_matrix(self, q):
        return jnp.eye(self.count)

    def potential(self, t, q):
        return jnp.zeros(())

    def force(self, t, q, v):
        return jnp.zeros_like(q)

    def contacts(self):
        gaps = [partial(lambda i, q: q[i + 1] - q[i], i) for i in range(self.count - 1)]
        return [ij.Contact(gap, self.law) for gap in gaps]


K = 1e4  # the effective mass of two balls is a half


def cradle(count):
    return Cradle(ij.KelvinVoigt(omega0=np.sqrt(2 * K), gamma=0.0), count)


def test_cradle_of_springs_hands_on_the_speed():
    """Five touching balls with linear springs between them, hit by the first."""
    q, v = np.array([-0.01, 0.0, 1e-9, 2e-9, 3e-9]), np.array([1.0, 0, 0, 0, 0])

    def rates(t, y):
        squeeze = np.maximum(y[:4] - y[1:5], 0.0) * K
        push = np.concatenate([[0.0], squeeze]) - np.concatenate([squeeze, [0.0]])
        return np.concatenate([y[5:], push])

    system = ij.MechanicalSystem(cradle(5))
    found = ij.solve(
        system,
        system.start(0.0, q, v),
        [0.2],
        tolerance=1e-10,
        scale=ij.MechanicalState(q=jnp.full(5, 1e-6), v=jnp.full(5, 1e-3), internal=((),) * 4),
    )
    run = solve_ivp(rates, (0, 0.2), [*q, *v], "DOP853", rtol=1e-11, atol=1e-14, max_step=1e-4)
    assert found.result == ij.RESULTS.successful
    np.testing.assert_allclose(found.ys.v[0], run.y[5:, -1], atol=2e-6)
    np.testing.assert_allclose(jnp.sum(found.ys.v[0]), 1.0, rtol=1e-12)
    np.testing.assert_allclose(jnp.sum(found.ys.v[0] ** 2), 1.0, rtol=1e-9)
    assert found.ys.v[0, 4] > 0.9


def test_large_systems_take_runge_kutta_steps_and_small_ones_series():
    for count, kind in ((2, SeriesStep), (6, ExplicitStep)):
        system = ij.MechanicalSystem(cradle(count))
        start = as_start(system.start(0.0, np.arange(count), np.zeros(count)), np.dtype(float))
        assert isinstance(default_step(Equations(system), start, 1e-8), kind)
