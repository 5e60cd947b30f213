"""Mechanisms with several coordinates, against SciPy, the oscillator and closed forms."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactjax as ij
from impactjax._model.law import AbstractLaw
from tiers import thorough

G = 9.81


class Line(ij.AbstractMechanism):
    """Masses on a line, held by springs, with a stop between neighbours and one at a wall."""

    masses: jax.Array
    stiffness: jax.Array
    law: AbstractLaw
    wall: float = eqx.field(static=True)

    def mass_matrix(self, q):
        return jnp.diag(self.masses)

    def potential(self, t, q):
        return jnp.sum(self.stiffness * q * q) / 2

    def force(self, t, q, v):
        return jnp.zeros_like(q)

    def contacts(self):
        between = [
            ij.Contact(partial(lambda i, q: q[i + 1] - q[i] + 0.1, i), self.law)
            for i in range(self.masses.size - 1)
        ]
        return [*between, ij.Contact(lambda q: q[0] + self.wall, self.law)]


class CartPendulum(ij.AbstractMechanism):
    """A cart between walls that carries a pendulum."""

    cart: jax.Array
    bob: jax.Array
    length: jax.Array
    law: AbstractLaw

    def mass_matrix(self, q):
        mixed = self.bob * self.length * jnp.cos(q[1])
        own = jnp.stack([self.cart + self.bob, self.bob * self.length**2])
        return jnp.diag(own) + mixed * jnp.array([[0.0, 1.0], [1.0, 0.0]])

    def potential(self, t, q):
        return -G * self.bob * self.length * jnp.cos(q[1])

    def force(self, t, q, v):
        return jnp.zeros_like(q)

    def contacts(self):
        return [
            ij.Contact(lambda q: q[0] + 0.2, self.law),
            ij.Contact(lambda q: 0.3 - q[0], self.law),
        ]


def followed(rates, gaps, impact, y0, end, times):
    """A run of SciPy, restarted at each event, and the times of events."""
    t, y, found, states = 0.0, np.asarray(y0, float), [], []
    events = []
    for gap in gaps:

        def event(t, y, gap=gap):
            return gap(y)

        vars(event).update(terminal=True, direction=-1)
        events.append(event)
    while True:
        run = solve_ivp(
            rates, (t, end), y, "DOP853", rtol=1e-12, atol=1e-13, events=events, dense_output=True
        )
        inside = times[(times >= t) & (times < run.t[-1])]
        states.append(run.sol(inside).T)
        if run.status != 1:
            states.append(run.y[:, -1][None])
            return np.array(found), np.concatenate(states)
        which = next(i for i, each in enumerate(run.t_events) if each.size)
        t, y = run.t[-1], impact(which, run.y[:, -1])
        found.append(t)


def test_two_masses_with_a_stop_between_and_a_wall():
    masses, stiffness, r = np.array([1.0, 2.5]), np.array([40.0, 15.0]), 0.7
    times = np.linspace(0, 4, 81)

    def rates(t, y):
        return np.concatenate([y[2:], -stiffness / masses * y[:2]])

    def impact(which, y):
        x1, x2, v1, v2 = y
        if which == 1:
            return np.array([x1, x2, -r * v1, v2])
        change = -(1 + r) * (v2 - v1) / (1 / masses[0] + 1 / masses[1])
        return np.array([x1, x2, v1 - change / masses[0], v2 + change / masses[1]])

    gaps = [lambda y: y[1] - y[0] + 0.1, lambda y: y[0] + 0.25]
    mechanism = Line(jnp.asarray(masses), jnp.asarray(stiffness), ij.Restitution(r), 0.25)
    system = ij.MechanicalSystem(mechanism)
    q, v = np.array([0.4, 0.6]), np.array([0.5, -1.0])
    found = ij.solve(system, system.start(0.0, q, v), times, tolerance=1e-11)
    expected, states = followed(rates, gaps, impact, [*q, *v], 4.0, times)
    assert found.result == ij.RESULTS.successful
    assert len(expected) > 5
    assert int(found.events.count) == len(expected)
    np.testing.assert_allclose(found.events.t[: len(expected)], expected, atol=1e-8)
    np.testing.assert_allclose(found.ys.q, states[:, :2], atol=1e-8)
    np.testing.assert_allclose(found.ys.v, states[:, 2:], atol=1e-7)


def cart_pendulum(law):
    return CartPendulum(jnp.array(1.5), jnp.array(0.8), jnp.array(0.7), law)


def test_cart_pendulum_between_walls():
    cart, bob, length, r = 1.5, 0.8, 0.7, 0.9
    times = np.linspace(0, 3, 61)

    def matrix(q):
        mixed = bob * length * np.cos(q)
        return np.array([[cart + bob, mixed], [mixed, bob * length**2]])

    def rates(t, y):
        right = np.array(
            [bob * length * np.sin(y[1]) * y[3] ** 2, -bob * G * length * np.sin(y[1])]
        )
        return np.concatenate([y[2:], np.linalg.solve(matrix(y[1]), right)])

    def impact(which, y):
        impulse = np.linalg.solve(matrix(y[1]), [1.0, 0.0])
        return np.array([*y[:2], *(y[2:] - (1 + r) * y[2] * impulse / impulse[0])])

    gaps = [lambda y: y[0] + 0.2, lambda y: 0.3 - y[0]]
    system = ij.MechanicalSystem(cart_pendulum(ij.Restitution(r)))
    q, v = np.array([0.0, 1.0]), np.array([0.8, -1.0])
    found = ij.solve(system, system.start(0.0, q, v), times, tolerance=1e-11)
    expected, states = followed(rates, gaps, impact, [*q, *v], 3.0, times)
    assert found.result == ij.RESULTS.successful
    assert len(expected) > 3
    np.testing.assert_allclose(found.events.t[: len(expected)], expected, atol=1e-8)
    np.testing.assert_allclose(found.ys.q, states[:, :2], atol=1e-8)


@thorough
@pytest.mark.parametrize("r", [1.0, 0.8])
def test_energy_is_lost_at_impacts_only(r):
    """An impact takes (1 − r²) m u²/2 of the energy, with the effective mass m and the speed u."""
    system = ij.MechanicalSystem(cart_pendulum(ij.Restitution(r)))
    start = system.start(0.0, [0.0, 1.0], [0.8, -1.0])
    found = ij.solve(system, start, np.linspace(0, 3, 31), tolerance=1e-14)
    log, count = found.events, int(found.events.count)
    assert count > 3
    states = jax.tree.map(lambda column: column[:count], log.before)
    matrices = jax.vmap(system.mechanism.mass_matrix)(states.q)
    masses = 1 / np.linalg.inv(matrices)[:, 0, 0]
    lost = (1 - r**2) * masses * states.v[:, 0] ** 2 / 2
    before = np.array([np.sum(lost[log.t[:count] < t]) for t in found.ts])
    energies = jax.vmap(system.energy)(found.ts, found.ys)
    np.testing.assert_allclose(energies + before, energies[0], rtol=1e-12)


@thorough
@pytest.mark.parametrize(
    "law",
    [
        ij.Restitution(0.8),
        ij.KelvinVoigt(omega0=200.0, gamma=0.1),
        ij.Maxwell(omega0=200.0, gamma=0.5),
        ij.KelvinVoigt(omega0=200.0, gamma=0.1, separation=ij.AtZeroForce()),
    ],
    ids=["restitution", "kelvin-voigt", "maxwell", "at-zero-force"],
)
def test_one_coordinate_is_the_oscillator(law):
    class Swing(ij.AbstractMechanism):
        law: AbstractLaw

        def mass_matrix(self, q):
            return jnp.ones((1, 1))

        def potential(self, t, q):
            return -jnp.cos(q[0]) * 36.0

        def force(self, t, q, v):
            return -0.2 * v

        def contacts(self):
            return [ij.Contact(lambda q: q[0], self.law)]

    ts = np.linspace(0, 1.5, 151)
    system = ij.MechanicalSystem(Swing(law))
    found = ij.solve(system, system.start(0.0, [0.5], [0.0]), ts, tolerance=1e-11)
    pendulum = ij.Pendulum(omega_n=6.0, zeta=0.1 / 6.0)
    expected = ij.simulate(
        ij.ImpactOscillator(pendulum, ij.Stop(law)), ij.InitialState(0.5), ts, tolerance=1e-11
    )
    assert found.result == ij.RESULTS.successful
    np.testing.assert_allclose(found.ys.q[:, 0], expected.position, atol=3e-9)


class Block(ij.AbstractMechanism):
    """A block above a floor, pushed up by a force that grows with time."""

    law: AbstractLaw
    growth: jax.Array

    def mass_matrix(self, q):
        return 2.0 * jnp.eye(1)

    def potential(self, t, q):
        return 2.0 * G * q[0]

    def force(self, t, q, v):
        return self.growth * t * jnp.ones_like(q)

    def contacts(self):
        return [ij.Contact(lambda q: q[0], self.law)]


def landed(growth):
    system = ij.MechanicalSystem(Block(ij.Restitution(0.5), growth))
    ts = np.array([0.2, 1.0, 1.5, 3.0])
    return ij.solve(system, system.start(0.0, [0.1], [0.0]), ts, tolerance=1e-12)


def test_block_rests_and_is_released():
    growth = 10.0
    found = landed(jnp.array(growth))
    release = 2.0 * G / growth
    count = int(found.events.count)
    assert found.result == ij.RESULTS.successful
    np.testing.assert_allclose(found.events.t[count - 1], release, rtol=1e-10)
    np.testing.assert_array_equal(found.modes[:, 0], [0, 3, 3, 0])
    np.testing.assert_allclose(found.ys.q[1:3], 0.0, atol=1e-12)
    after = 3.0 - release
    np.testing.assert_allclose(found.ys.q[3, 0], growth * after**3 / 12, rtol=1e-9)


@thorough
def test_derivative_of_a_release():
    def height(growth):
        return landed(growth).ys.q[3, 0]

    growth = 10.0
    after = 3.0 - 2 * G / growth
    expected = after**3 / 12 + growth * after**2 / 4 * 2 * G / growth**2
    for gradient in (jax.jacfwd(height), jax.jacrev(height)):
        np.testing.assert_allclose(gradient(jnp.array(growth)), expected, rtol=1e-8)
