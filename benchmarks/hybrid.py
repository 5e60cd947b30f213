"""Cost of the general layer: one coordinate beside the oscillator, larger states, mechanisms, and
sections over many periods.

Run: python benchmarks/hybrid.py
"""

import time
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

import impactjax as ij

jax.config.update("jax_enable_x64", val=True)

LANES = 500
TS = jnp.arange(1401) / 1000
PARAMETERS = jnp.array([6.0, 0.01, 0.75])


class Swing(ij.HybridSystem):
    """Copies of a pendulum, of which the first one meets a stop: a state of 2 n numbers."""

    omega: Array
    zeta: Array
    restitution: Array
    copies: int = eqx.field(static=True)

    def flow(self, t, y, mode):
        x, v = y
        damping = 2 * self.zeta * self.omega * v
        return v, -(self.omega**2) * jnp.sin(x) - damping

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: y[0][0], self.bounce)]

    def bounce(self, t, y, mode):
        x, v = y
        return (x, v.at[0].multiply(-self.restitution)), mode


def general(copies: int, p: Array) -> Array:
    start = ij.Start(0.0, (jnp.full(copies, 0.78), jnp.zeros(copies)))
    system = Swing(p[0], p[1], p[2], copies)
    found = ij.solve(system, start, TS, max_steps=64, max_events=16, step=ij.TaylorStep(11))
    return found.ys[0]


def oscillator(p: Array) -> Array:
    model = ij.ImpactOscillator(ij.Pendulum(p[0], p[1]), ij.Stop(ij.Restitution(p[2])))
    step = ij.TaylorStep(11)
    return ij.simulate(model, ij.InitialState(0.78), TS, max_steps=64, step=step).position


class Double(ij.AbstractMechanism):
    """A double pendulum on a stop."""

    mass: Array
    length: Array

    def mass_matrix(self, q):
        mixed = jnp.cos(q[0] - q[1]) * jnp.array([[0.0, 1.0], [1.0, 0.0]])
        return (jnp.diag(jnp.array([2.0, 1.0])) + mixed) * self.mass * self.length**2

    def potential(self, t, q):
        return -9.81 * self.mass * self.length * (2 * jnp.cos(q[0]) + jnp.cos(q[1]))

    def force(self, t, q, v):
        return jnp.zeros_like(q)

    def contacts(self):
        return [ij.Contact(self.distance, ij.Restitution(0.8))]

    def distance(self, q):
        return self.length * (jnp.sin(q[0]) + jnp.sin(q[1])) + 0.1


def double(p: Array) -> Array:
    system = ij.MechanicalSystem(Double(p[0], p[1]))
    start = system.start(0.0, [0.5, 0.3], [0.0, 0.0])
    return ij.solve(system, start, jnp.linspace(0, 3, 301), max_steps=512).ys.q


class Forced(ij.HybridSystem):
    """A forced linear oscillator with a stop."""

    frequency: Array

    def flow(self, t, y, mode):
        x, v = y
        return v, -x - 0.1 * v + jnp.cos(self.frequency * t)

    def transitions(self):
        return [
            ij.Transition(lambda t, y, mode: y[0] + 1, lambda t, y, m: ((y[0], -0.7 * y[1]), m))
        ]


def compiled(
    function: Callable[..., Array], *arguments: Array
) -> tuple[Callable[..., Array], float]:
    begin = time.process_time()
    program = jax.jit(function).lower(*arguments).compile()
    return program, time.process_time() - begin


def fastest(program: Callable[..., Array], *arguments: Array) -> float:
    program(*arguments).block_until_ready()
    times = []
    for _ in range(7):
        begin = time.perf_counter()
        program(*arguments).block_until_ready()
        times.append(time.perf_counter() - begin)
    return min(times)


def batches() -> None:
    lanes = PARAMETERS * (1 + 1e-3 * jnp.arange(LANES)[:, None] / LANES)
    cases = {"oscillator": oscillator}
    for copies in (1, 2, 8):
        cases[f"general, {2 * copies} numbers"] = lambda p, n=copies: general(n, p)
    print(f"{'':32} {'compile [CPU s]':>16} {'per lane [us]':>14}")
    for name, case in cases.items():
        for title, function in ((name, case), (f"{name}, Jacobian", jax.jacfwd(case))):
            program, cost = compiled(jax.vmap(function), lanes)
            print(
                f"{title:32} {cost:16.1f} {fastest(program, lanes) / LANES * 1e6:14.1f}", flush=True
            )


def mechanism() -> None:
    ones = jnp.ones(2)
    for title, function in (("", double), (" with Jacobian", jax.jacfwd(double))):
        program, cost = compiled(function, ones)
        ms = 1e3 * fastest(program, ones)
        print(f"double pendulum{title}: {cost:.1f} CPU s to compile, {ms:.2f} ms a run", flush=True)


class Marked(ij.HybridSystem):
    """The same with an event at each period, which changes nothing."""

    system: Forced
    period: Array

    def flow(self, t, y, mode):
        return self.system.flow(t, y, mode)

    def transitions(self):
        (stop,) = self.system.transitions()

        def next_period(t, y, mode):
            return (mode + 1) * self.period - t

        return [stop, ij.Transition(next_period, lambda t, y, mode: (y, mode + 1))]


def sections() -> None:
    frequency = 2.2
    period, start = 2 * jnp.pi / frequency, ij.Start(0.0, (0.3, 0.0))
    system = Forced(jnp.array(frequency))
    marked, end = Marked(system, jnp.array(period)), jnp.array([1000.5 * period])

    def section(skip: int) -> Array:
        return ij.section(system, start, ij.Every(period), keep=10, skip=skip).t

    def one_call() -> Array:
        return ij.solve(marked, start, end, max_steps=16384, max_events=2048).events.t

    whole, pieces = 1e6 * fastest(one_call) / 1000, 1e6 * fastest(lambda: section(1000)) / 1010
    print(f"1,000 periods: {whole:.1f} us each in one call, {pieces:.1f} us in a section")
    print(f"30,000 periods in a section: {fastest(lambda: section(30_000)):.2f} s", flush=True)


if __name__ == "__main__":
    batches()
    mechanism()
    sections()
