"""Draws how the cost of a simulation grows with lanes, impacts and samples.

    python benchmarks/scaling.py docs/figures/scaling.png

Each point is relative to the first of its line, so that the figure holds on any machine.
"""

import sys
import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array

import impactjax as ij
import ours
from rivals import tasks

LANES = np.array([50, 100, 200, 400, 800])
IMPACTS = np.array([20, 40, 80, 160, 320])
SAMPLES = np.array([500, 1000, 2000, 4000, 8000])


def _ball(r: Array, impacts: int) -> Array:
    """A lossless ball over so many impacts; the last position."""
    model = ij.ImpactOscillator(ij.Pendulum(10.0), ij.Stop(ij.Restitution(r)))
    end = jnp.array([(impacts + 0.5) * np.pi / 10.0])
    steps = 4 * int(IMPACTS[-1])
    run = ij.simulate(model, ij.InitialState(0.2), end, t0=0.0, max_steps=steps)
    return run.position[0]


def _sampled(values: Array, count: int) -> Array:
    model = ours.model(tasks.RESTITUTION, values)
    times = jnp.linspace(0.0, tasks.DURATION, count)
    return ij.simulate(model, ij.InitialState(values[-1]), times, max_steps=64).position


def _lanes(count: int) -> Callable[[], Array]:
    rows = jnp.asarray(tasks.drawn_parameters(tasks.RESTITUTION)[:count])

    def one(values: Array) -> Array:
        return ours.angles(tasks.RESTITUTION, values)

    compiled = jax.jit(lambda rows: jax.lax.map(one, rows, batch_size=ours.TOGETHER))
    return lambda: compiled(rows)


def _impacts(count: int) -> Callable[[], Array]:
    rates = jnp.full(ours.TOGETHER, 1.0)
    compiled = jax.jit(jax.vmap(lambda r: _ball(r, count)))
    return lambda: compiled(rates)


def _samples(count: int) -> Callable[[], Array]:
    rows = jnp.asarray(tasks.drawn_parameters(tasks.RESTITUTION)[: ours.TOGETHER])
    compiled = jax.jit(jax.vmap(lambda values: _sampled(values, count)))
    return lambda: compiled(rows)


def _fastest(run: Callable[[], Array]) -> float:
    run().block_until_ready()
    times = []
    for _ in range(15):
        begin = time.perf_counter()
        run().block_until_ready()
        times.append(time.perf_counter() - begin)
    return min(times)


def main() -> None:
    _, axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
    lines = (
        ("lanes", LANES, _lanes),
        ("impacts", IMPACTS, _impacts),
        ("samples", SAMPLES, _samples),
    )
    for ax, (name, counts, prepared) in zip(axes, lines, strict=True):
        seconds = np.array([_fastest(prepared(int(count))) for count in counts])
        ax.loglog(counts / counts[0], seconds / seconds[0], "o-", color="#b3261e", label="measured")
        ax.loglog(counts / counts[0], counts / counts[0], "--", color="#8fa3b5", label="linear")
        ax.set(xlabel=f"{name}, relative to {counts[0]}", ylabel="time, relative")
        ax.legend(frameon=False)
        print(name, np.round(seconds / seconds[0], 2))
    plt.savefig(sys.argv[1], dpi=110)


if __name__ == "__main__":
    main()
