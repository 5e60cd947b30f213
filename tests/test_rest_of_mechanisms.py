"""Mechanisms that come to rest, and leave it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from test_mechanics import Block, G, cart_pendulum, landed
from tiers import thorough


class Leaning(ij.AbstractMechanism):
    """A cart with a pendulum, on a slope that ends at a wall."""

    push: jax.Array
    cart: ij.AbstractMechanism

    def mass_matrix(self, q):
        return self.cart.mass_matrix(q)

    def potential(self, t, q):
        return self.cart.potential(t, q) + self.push * q[0]

    def force(self, t, q, v):
        return -0.3 * v

    def contacts(self):
        return self.cart.contacts()


def leaning(law):
    system = ij.MechanicalSystem(Leaning(jnp.array(15.0), cart_pendulum(law)))
    return ij.solve(system, system.start(0.0, [0.0, 0.4], [0.0, 0.0]), [1.0, 2.0], tolerance=1e-10)


def test_pendulum_swings_on_a_cart_at_rest():
    """At rest the cart's rate is zero up to rounding, of which a step must not ask a relative
    accuracy.
    """
    found = leaning(ij.Restitution(0.4))
    assert found.result == ij.RESULTS.successful
    assert found.steps < 200
    np.testing.assert_array_equal(found.modes, [[3, 0], [3, 0]])
    np.testing.assert_allclose(found.ys.q[:, 0], -0.2, atol=1e-12)
    assert abs(found.ys.v[1, 1]) > 1e-3


@thorough
def test_settled_contact_needs_no_relative_accuracy():
    """The speed of a part that has settled in a stop decays to nothing."""
    found = leaning(ij.KelvinVoigt(omega0=100.0, gamma=0.6))
    assert found.result == ij.RESULTS.successful
    assert found.steps < 1000


class Pile(ij.AbstractMechanism):
    """Two blocks on each other above a floor."""

    law: ij.Restitution

    def mass_matrix(self, q):
        return jnp.diag(jnp.array([1.0, 2.5]))

    def potential(self, t, q):
        return G * (q[0] + 2.5 * q[1])

    def force(self, t, q, v):
        return jnp.zeros_like(q)

    def contacts(self):
        return [
            ij.Contact(lambda q: q[1] - q[0] - 0.1, self.law),
            ij.Contact(lambda q: q[0], self.law),
        ]


@thorough
def test_pile_comes_to_rest():
    """Both contacts bounce at ever shorter times: they are summed together."""
    system = ij.MechanicalSystem(Pile(ij.Restitution(0.6)))
    start = system.start(0.0, [0.05, 0.2], [0.0, 0.0])
    found = ij.solve(system, start, [2.0], tolerance=1e-10, max_events=256)
    assert found.result == ij.RESULTS.successful
    np.testing.assert_array_equal(found.modes, [[3, 3]])
    np.testing.assert_allclose(found.ys.q, [[0.0, 0.1]], atol=1e-8)
    np.testing.assert_allclose(found.ys.v, 0.0, atol=1e-12)


@thorough
def test_releases_are_for_good():
    """Whatever the rounding at a release, the block does not rest again, nor hit the floor."""
    growth = jnp.linspace(8.0, 16.0, 256)
    found = jax.vmap(landed)(growth)
    np.testing.assert_array_equal(found.result._value, ij.RESULTS.successful._value)
    np.testing.assert_array_equal(found.modes[:, 3, 0], 0)
    np.testing.assert_allclose(
        found.ys.q[:, 3, 0], growth * (3.0 - 2 * G / growth) ** 3 / 12, rtol=1e-8
    )


def test_start_inside_a_rigid_contact_is_refused():
    system = ij.MechanicalSystem(Block(ij.Restitution(0.5), jnp.array(1.0)))
    with pytest.raises(ValueError, match="inside contact 0"):
        system.start(0.0, [-0.1], [0.0])
