"""Two systems with several guards against SciPy, restarted at its events."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactjax as ij
from tiers import mostly_thorough

END, LANES, EVENTS = 4.0, 100, 24
STEPS = {"Taylor": None, "Tsit5": ij.RungeKutta()}


class Masses(ij.HybridSystem):
    """Two masses on springs, a stop between them and a wall; p = (k1, k2, mass, r)."""

    p: jax.Array

    def flow(self, t, y, mode):
        k1, k2, mass, _ = self.p
        x, v = y["x"], y["v"]
        spring = k2 * (x[1] - x[0] - 1)
        return {"x": v, "v": jnp.stack([spring - k1 * x[0] + jnp.cos(2 * t), -spring / mass])}

    def transitions(self):
        def wall(t, y, mode):
            return {**y, "v": y["v"] * jnp.stack([-self.p[3], jnp.ones_like(t)])}, mode

        def meet(t, y, mode):
            mass, r, v = self.p[2], self.p[3], y["v"]
            push = (1 + r) * mass / (1 + mass) * (v[1] - v[0])
            return {**y, "v": v + push * jnp.stack([jnp.ones_like(t), -1 / mass])}, mode

        return [
            ij.Transition(lambda t, y, mode: y["x"][0] + 0.3, wall),
            ij.Transition(lambda t, y, mode: y["x"][1] - y["x"][0] - 0.8, meet),
        ]


class Pendulum(ij.HybridSystem):
    """A pendulum between two stops of different restitution; p = (ω², ζ, stop, r)."""

    p: jax.Array

    def flow(self, t, y, mode):
        square, zeta, _, _ = self.p
        return {"x": y["v"], "v": -square * jnp.sin(y["x"]) - zeta * y["v"] + jnp.sin(3 * t)}

    def transitions(self):
        def bounce(share):
            return lambda t, y, mode: ({**y, "v": -share * self.p[3] * y["v"]}, mode)

        return [
            ij.Transition(lambda t, y, mode: y["x"] + self.p[2], bounce(1.0)),
            ij.Transition(lambda t, y, mode: 0.6 - y["x"], bounce(0.5)),
        ]


def masses(p):
    """The flow, guards and jumps of the masses, written down once more: y = (x₁, x₂, v₁, v₂)."""
    k1, k2, m, r = p

    def flow(t, y):
        pull = k2 * (y[1] - y[0] - 1)
        return [y[2], y[3], pull - k1 * y[0] + np.cos(2 * t), -pull / m]

    def meet(y):
        total, apart = (y[2] + m * y[3]) / (1 + m), r * (y[2] - y[3])
        return [y[0], y[1], total - m * apart / (1 + m), total + apart / (1 + m)]

    guards = [lambda t, y: y[0] + 0.3, lambda t, y: y[1] - y[0] - 0.8]
    return flow, guards, [lambda y: [y[0], y[1], -r * y[2], y[3]], meet]


def pendulum(p):
    square, zeta, stop, r = p

    def flow(t, y):
        return [y[1], -square * np.sin(y[0]) - zeta * y[1] + np.sin(3 * t)]

    guards = [lambda t, y: y[0] + stop, lambda t, y: 0.6 - y[0]]
    return flow, guards, [lambda y: [y[0], -r * y[1]], lambda y: [y[0], -r / 2 * y[1]]]


def restarted(flow, guards, jumps, y):
    """Times and numbers of the events, and the final state."""
    t, log = 0.0, []
    for guard in guards:
        guard.terminal, guard.direction = True, -1
    while len(log) <= EVENTS:
        run = solve_ivp(flow, (t, END), y, "DOP853", events=guards, rtol=1e-12, atol=1e-14)
        if run.status == 0:
            return np.array(log).reshape(-1, 2), run.y[:, -1]
        number = next(i for i, times in enumerate(run.t_events) if times.size)
        t, y = run.t[-1], jumps[number](run.y[:, -1])
        log.append((t, number))
    return np.array(log), np.full(len(y), np.nan)  # more events than the log holds


def random_case(name):
    random = np.random.default_rng(5)
    low, high = {
        "masses": ([2.0, 2.0, 0.5, 0.6, 0.0, 1.0, -2.0, -2.0], [30, 30, 2.0, 1.0, 0.5, 1.5, 2, 2]),
        "pendulum": ([5.0, 0.0, 0.2, 0.6, 0.0, -2.0], [30.0, 0.5, 0.6, 1.0, 0.5, 2.0]),
    }[name]
    return random.uniform(low, high, (LANES, len(low)))


@functools.cache
def reference(name):
    written = {"masses": masses, "pendulum": pendulum}[name]
    return [restarted(*written(row[:4]), row[4:]) for row in random_case(name)]


def simulated(name, step):
    def run(row):
        y = row[4:].reshape(2, -1)
        first = {"x": y[0], "v": y[1]} if name == "masses" else {"x": y[0, 0], "v": y[1, 0]}
        system = {"masses": Masses, "pendulum": Pendulum}[name](row[:4])
        return ij.solve(
            system,
            ij.Start(0.0, first),
            jnp.array([END]),
            tolerance=1e-11,
            max_events=EVENTS,
            max_steps=8192,
            step=STEPS[step],
        )

    return jax.jit(jax.vmap(run))(jnp.array(random_case(name)))


CASES = [(name, step) for name in ("masses", "pendulum") for step in STEPS]


@pytest.mark.parametrize(
    ("name", "step"), mostly_thorough(CASES, ("masses", "Taylor"), ("pendulum", "Tsit5"))
)
def test_random_runs(name, step):
    found = simulated(name, step)
    end = np.concatenate([np.reshape(found.ys[k], (LANES, -1)) for k in ("x", "v")], axis=1)
    compared = 0
    for lane, (log, final) in enumerate(reference(name)):
        if np.any(np.isnan(final)):
            continue
        compared += 1
        count = len(log)
        assert found.result[lane] == ij.RESULTS.successful
        assert found.events.count[lane] == count
        np.testing.assert_array_equal(found.events.transition[lane, :count], log[:, 1])
        np.testing.assert_allclose(found.events.t[lane, :count], log[:, 0], rtol=1e-7)
        np.testing.assert_allclose(end[lane], final, rtol=1e-6, atol=1e-6)
    assert compared > 0.8 * LANES
