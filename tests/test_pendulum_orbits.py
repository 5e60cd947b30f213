"""Branch of the forced pendulum on a Kelvin-Voigt stop, whose numbers were found by stroboscopic
maps of `simulate`, another engine.
"""

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from tiers import thorough

OMEGA_N, ZETA, LENGTH, MASS, AMPLITUDE = 13.47, 0.0017, 0.071, 0.1, 5.2e-3
DAMPING_RATIO = -np.log(0.6) / np.hypot(np.pi, np.log(0.6))


class Pendulum(ij.AbstractMechanism):
    """A pendulum on a base that moves with A sin 2πft, above one stop."""

    hertz: jax.Array

    def mass_matrix(self, q):
        return jnp.full((1, 1), MASS * LENGTH**2)

    def potential(self, t, q):
        return -MASS * LENGTH**2 * OMEGA_N**2 * jnp.cos(q[0])

    def force(self, t, q, v):
        omega = 2 * np.pi * self.hertz
        base = AMPLITUDE / LENGTH * omega**2 * jnp.sin(omega * t) * jnp.cos(q)
        return MASS * LENGTH**2 * (base - 2 * ZETA * OMEGA_N * v)

    def contacts(self):
        return [ij.Contact(lambda q: LENGTH * q[0], ij.KelvinVoigt(725.0, DAMPING_RATIO))]


@thorough
def test_period_doubling_and_grazing_of_the_forced_pendulum():
    system = ij.MechanicalSystem(Pendulum(jnp.array(5.45)))
    start = system.start(0.0, jnp.array([0.3]), jnp.array([0.0]))
    orbit = ij.periodic_orbit(system, start, lambda each: 1 / each.mechanism.hertz, settle=400)
    assert orbit.stability == "stable"
    branch = ij.follow(orbit, lambda each: each.mechanism.hertz, (5.4, 6.5))
    (doubling,) = [each for each in branch.special if each.kind == "period doubling"]
    np.testing.assert_allclose(doubling.parameter, 5.466183792555, rtol=0, atol=1e-11)
    np.testing.assert_allclose(doubling.orbit.multipliers[0], -1.0, atol=1e-9)
    double = ij.follow(ij.doubled(doubling.orbit), lambda each: each.mechanism.hertz, (5.4, 6.5))
    assert double.special[-1].kind == "grazing"
    np.testing.assert_allclose(double.special[-1].parameter, 6.3566, atol=5e-5)
