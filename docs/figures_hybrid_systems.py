"""Makes the figure of the page on hybrid systems: `python docs/figures_hybrid_systems.py`."""

# ruff: noqa: ANN001, ANN201, ARG002, ARG005, D102  the systems as they stand on the page

import math
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Array
from matplotlib.axes import Axes

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
BLUE, RED, GREY = "#1f4e79", "#b3261e", "#8fa3b5"


class Ball(ij.HybridSystem):
    """A ball in units of its first height and of gravity, with r = 0.7."""

    def flow(self, t, y, mode):
        return {"height": y["speed"], "speed": jnp.where(mode == 1, 0.0 * t, -1.0)}

    def transitions(self):
        return [ij.Transition(self.guard, self.bounce, self.tail)]

    def guard(self, t, y, mode):
        return jnp.where(mode == 1, 1.0, y["height"])

    def bounce(self, t, y, mode):
        return {**y, "speed": -0.7 * y["speed"]}, mode

    def tail(self, t, y, mode):
        duration = 2 * y["speed"] / (1 - 0.7)
        return ij.Tail(duration < 1e-6, duration, {"height": 0.0, "speed": 0.0}, mode + 1)


class Billiard(ij.HybridSystem):
    """A point in the ellipse x²/4 + y² ≤ 1."""

    def flow(self, t, y, mode):
        return {"x": y["vx"], "y": y["vy"], "vx": 0.0 * t, "vy": 0.0 * t}

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: 1 - y["x"] ** 2 / 4 - y["y"] ** 2, self.reflect)]

    def reflect(self, t, y, mode):
        nx, ny = y["x"] / 4, y["y"]
        change = 2 * (nx * y["vx"] + ny * y["vy"]) / (nx**2 + ny**2)
        return {**y, "vx": y["vx"] - change * nx, "vy": y["vy"] - change * ny}, mode


class ForcedMass(ij.HybridSystem):
    """x″ + 0.1 x′ + x = cos(Ω t), with a stop at x = 0 of restitution 0.8."""

    frequency: Array

    def flow(self, t, y, mode):
        return {"x": y["v"], "v": jnp.cos(self.frequency * t) - 0.1 * y["v"] - y["x"]}

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: y["x"], self.impact)]

    def impact(self, t, y, mode):
        return {**y, "v": -0.8 * y["v"]}, mode


def main() -> None:
    """A ball that comes to rest, a billiard, and a stroboscopic section."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(
        1, 3, figsize=(9, 2.7), width_ratios=[1, 1.4, 1], layout="constrained"
    )
    draw_ball(axes[0])
    draw_billiard(axes[1])
    draw_section(axes[2])
    figure.savefig(HERE / "figures" / "hybrid-systems.png", dpi=125)


def draw_ball(ax: Axes) -> None:
    """Height against time, up to rest."""
    ts = jnp.linspace(0.0, 9.5, 951)
    run = ij.solve(Ball(), ij.Start(0.0, {"height": 1.0, "speed": 0.0}), ts)
    rest = float(run.events.until[run.events.count - 1])
    ax.plot(ts, run.ys["height"], color=BLUE, linewidth=1.2)
    ax.plot([rest], [0], "o", color=RED, markersize=4)
    ax.annotate("at rest", (rest, 0.05), color=RED, ha="center")
    ax.set(xlabel="time √(g/h)", ylabel="height / h", xlim=(0, 9.5), ylim=(-0.02, 1.05))


def draw_billiard(ax: Axes) -> None:
    """The path from reflection to reflection."""
    start = {"x": 0.5, "y": 0.0, "vx": 0.6, "vy": 0.8}
    log = ij.solve(Billiard(), ij.Start(0.0, start), jnp.array([110.0])).events
    x, y = (np.append(start[each], np.asarray(log.after[each])) for each in ("x", "y"))
    around = np.linspace(0, 2 * math.pi, 400)
    ax.plot(2 * np.cos(around), np.sin(around), color=GREY, linewidth=1.5)
    ax.plot(x, y, color=BLUE, linewidth=0.6)
    ax.plot([-math.sqrt(3), math.sqrt(3)], [0, 0], "o", color=RED, markersize=4)
    ax.annotate("focus", (-1.66, 0.03), color=RED)
    ax.set(aspect="equal")
    ax.axis("off")


def draw_section(ax: Axes) -> None:
    """States at one phase of the force."""
    frequency = 2.8
    start = ij.Start(0.0, {"x": 0.3, "v": 0.0})
    times = ij.Every(2 * math.pi / frequency)
    points = ij.section(ForcedMass(jnp.array(frequency)), start, times, keep=3000, skip=200)
    ax.plot(points.after["x"], points.after["v"], ".", color=BLUE, markersize=1)
    ax.set(xlabel="x", ylabel="x′")


if __name__ == "__main__":
    main()
