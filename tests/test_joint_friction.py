"""Dry friction in mechanisms: closed forms, SciPy, and the oscillator."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

import impactjax as ij
from tiers import thorough

M, K, F = 2.0, 50.0, 6.0
OMEGA = np.sqrt(K / M)


class Block(ij.AbstractMechanism):
    """A block on a spring, on a rough floor."""

    limit: jax.Array

    def mass_matrix(self, q):
        return M * jnp.eye(1)

    def potential(self, t, q):
        return K * (q @ q) / 2

    def force(self, t, q, v):
        return jnp.zeros_like(q)

    def contacts(self):
        return []

    def friction(self):
        return [ij.Friction(lambda q: q[0], self.limit)]


TIMES = np.array([1.0, 3.0])


def released(limit):
    system = ij.MechanicalSystem(Block(limit))
    return ij.solve(system, system.start(0.0, [1.0], [0.0]), TIMES, tolerance=1e-12)


def test_block_on_a_rough_floor():
    """Each half period takes 2 F/k off the amplitude, until |k x| ≤ F."""
    found = released(jnp.array(F))
    count = int(found.events.count)
    assert found.result == ij.RESULTS.successful
    halves = np.arange(1, count + 1)
    np.testing.assert_allclose(found.events.t[:count], np.pi / OMEGA * halves, rtol=1e-12)
    turns = (-1.0) ** halves * (1 - 2 * F / K * halves)
    np.testing.assert_allclose(found.events.before.q[:count, 0], turns, rtol=1e-10)
    np.testing.assert_array_equal(found.events.mode_after[:count, 0], [1, -1, 1, 0])
    assert K * abs(turns[-1]) <= F < K * abs(turns[-2])
    np.testing.assert_allclose(found.ys.q[-1, 0], turns[-1], rtol=1e-10)


@thorough
def test_derivatives_of_a_block_on_a_rough_floor():
    """Sample 1 lies in the second half period, x = F/k + (1 − 3 F/k) cos ω t."""

    def places(limit):
        return released(limit).ys.q[:, 0]

    np.testing.assert_allclose(
        places(jnp.array(F))[0], F / K * -1 + (1 - 3 * F / K) * np.cos(OMEGA), rtol=1e-10
    )
    expected = [-1 / K - 3 / K * np.cos(OMEGA), -8 / K]
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(derivative(places)(jnp.array(F)), expected, rtol=1e-9)


@thorough
def test_rough_floor_of_the_oscillator():
    ts = np.linspace(0, 3, 61)
    system = ij.MechanicalSystem(Block(jnp.array(F)))
    found = ij.solve(system, system.start(0.0, [1.0], [0.3]), ts, tolerance=1e-11)
    smooth = ij.LinearOscillator(omega_n=OMEGA, zeta=0.0, dry_friction=F / M)
    model = ij.ImpactOscillator(smooth, None)
    expected = ij.simulate(model, ij.InitialState(1.0, 0.3), ts, tolerance=1e-11)
    np.testing.assert_allclose(found.ys.q[:, 0], expected.position, atol=1e-9)


class AtWall(ij.AbstractMechanism):
    """A block on a rough floor that is pushed against a wall by 20 − 10 t."""

    limit: jax.Array

    def mass_matrix(self, q):
        return M * jnp.eye(1)

    def potential(self, t, q):
        return jnp.zeros_like(t)

    def force(self, t, q, v):
        return (10 * t - 20) * jnp.ones_like(q)

    def contacts(self):
        return [ij.Contact(lambda q: q[0], ij.Restitution(0.5))]

    def friction(self):
        return [ij.Friction(lambda q: 2 * q[0], self.limit)]


@thorough
def test_friction_acts_against_release_from_a_wall():
    """The generalised friction is 2 · 3 N, so that the block leaves at 10 t − 20 = 6."""
    system = ij.MechanicalSystem(AtWall(jnp.array(3.0)))
    start = system.start(0.0, [0.1], [0.0])
    found = ij.solve(system, start, np.array([2.5, 4.0]), tolerance=1e-11)
    assert found.result == ij.RESULTS.successful
    np.testing.assert_array_equal(found.modes, [[3, 1], [0, 1]])
    np.testing.assert_allclose(found.ys.q[:, 0], [0, 10 * 1.4**3 / (6 * M)], atol=1e-10)


@thorough
def test_negative_friction_is_no_result():
    assert released(jnp.array(-1.0)).result == ij.RESULTS.non_finite


class Carried(ij.AbstractMechanism):
    """A block on a cart that is shaken: they stick and slip."""

    limit: jax.Array

    def mass_matrix(self, q):
        return jnp.diag(jnp.array([3.0, 1.0]))

    def potential(self, t, q):
        return 100 * q[0] * q[0]

    def force(self, t, q, v):
        return jnp.stack([30 * jnp.cos(5 * t), jnp.zeros_like(t)])

    def contacts(self):
        return []

    def friction(self):
        return [ij.Friction(lambda q: q[1] - q[0], self.limit)]


def carried_in_scipy(limit, ts):
    """Stick and slip, located as roots of the dense output."""
    t, y, slip, rows, events = 0.0, np.zeros(4), 0, [], []

    def forces(t, y):
        push = 30 * np.cos(5 * t) - 200 * y[0]
        needed = push / 4  # force on the block if it sticks
        return push, needed if slip == 0 else -limit * slip

    def rates(t, y):
        push, block = forces(t, y)
        return np.array([y[2], y[3], (push - block) / 3, block])

    def guard(t, y):
        return limit - abs(forces(t, y)[1]) if slip == 0 else slip * (y[3] - y[2])

    if limit < abs(forces(t, y)[1]):
        slip = -int(np.sign(forces(t, y)[1]))
    while t < ts[-1]:
        options = {"rtol": 1e-13, "atol": 1e-14, "max_step": 0.01, "dense_output": True}
        run = solve_ivp(rates, (t, ts[-1]), y, "DOP853", **options)
        nodes = np.linspace(t, ts[-1], 20001)[1:]
        values = np.array([guard(s, run.sol(s)) for s in nodes])
        fallen = np.flatnonzero((values[:-1] > 0) & (values[1:] <= 0))
        end = ts[-1]
        if fallen.size:
            low, high = nodes[fallen[0]], nodes[fallen[0] + 1]
            end = root_scalar(
                lambda s, y=run.sol: guard(s, y(s)), bracket=(low, high), xtol=1e-15
            ).root
        inside = ts[(ts >= t) & (ts < end)]
        rows += [run.sol(s) for s in inside]
        t, y = end, run.sol(end)
        if fallen.size:
            events.append(t)
            before, slip = slip, 0
            needed = forces(t, y)[1]
            if before == 0 or abs(needed) > limit:
                slip = -int(np.sign(needed))
    return np.array(events), np.array([*rows, y])


@thorough
def test_block_on_a_shaken_cart():
    limit, ts = 2.0, np.linspace(0, 3, 31)
    system = ij.MechanicalSystem(Carried(jnp.array(limit)))
    found = ij.solve(system, system.start(0.0, [0.0, 0.0], [0.0, 0.0]), ts, tolerance=1e-11)
    events, rows = carried_in_scipy(limit, ts)
    assert found.result == ij.RESULTS.successful
    modes = set(np.ravel(found.events.mode_after[: int(found.events.count)]).tolist())
    assert modes == {-1, 0, 1}
    np.testing.assert_allclose(found.events.t[: events.size], events, atol=1e-9)
    np.testing.assert_allclose(found.ys.q, rows[:, :2], atol=1e-9)
