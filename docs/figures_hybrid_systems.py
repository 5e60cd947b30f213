"""Makes the figure of the page on hybrid systems: `python docs/figures_hybrid_systems.py`."""

import math
from pathlib import Path

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from page_code import names_of

import impactjax as ij

HERE = Path(__file__).parent
BLUE, RED, GREY = "#1f4e79", "#b3261e", "#8fa3b5"
PAGE = names_of("hybrid-systems.md")


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
    ball = PAGE["Ball"](jnp.array(1.0), jnp.array(0.7))
    run = ij.solve(ball, ij.Start(0.0, {"height": 1.0, "speed": 0.0}), ts)
    rest = float(run.events.until[run.events.count - 1])
    ax.plot(ts, run.ys["height"], color=BLUE, linewidth=1.2)
    ax.plot([rest], [0], "o", color=RED, markersize=4)
    ax.annotate("at rest", (rest, 0.05), color=RED, ha="center")
    ax.set(xlabel="time √(g/h)", ylabel="height / h", xlim=(0, 9.5), ylim=(-0.02, 1.05))


def draw_billiard(ax: Axes) -> None:
    """The path from reflection to reflection."""
    start = PAGE["point"]
    log = ij.solve(PAGE["Billiard"](), start, jnp.array([110.0])).events
    x, y = (np.append(start.y[each], np.asarray(log.after[each])) for each in ("x", "y"))
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
    mass, times = PAGE["ForcedMass"](jnp.array(frequency)), ij.Every(2 * math.pi / frequency)
    points = ij.section(mass, PAGE["begin"], times, keep=3000, skip=200)
    ax.plot(points.after["x"], points.after["v"], ".", color=BLUE, markersize=1)
    ax.set(xlabel="x", ylabel="x′")


if __name__ == "__main__":
    main()
