"""Makes the figure of the page on multiple scales: `python docs/figures_multiple_scales.py`."""

import math
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
EXACT, FORMULA, GREY = "#1f4e79", "#b3261e", "#8fa3b5"
DEGREES = 180 / math.pi
PENDULUM = ij.Pendulum(omega_n=13.47, zeta=0.0017, length=0.071)
R = 0.6


def main() -> None:
    """The piecewise trajectory beside the exact one, and restitution from successive peaks."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplot_mosaic(
        [["motion", "peaks"], ["error", "peaks"]],
        figsize=(9, 3.6),
        height_ratios=[2, 1],
        width_ratios=[1.25, 1],
        layout="constrained",
    )
    draw_trajectory(axes["motion"], axes["error"])
    draw_restitution(axes["peaks"])
    figure.savefig(HERE / "figures" / "multiple-scales.png", dpi=125)


def draw_trajectory(above: Axes, below: Axes) -> None:
    """Carter's Figure 3.2: release from 45 degrees."""
    ts = np.linspace(0.0, 1.5, 1501)
    released = ij.InitialState(math.pi / 4)
    model = ij.ImpactOscillator(PENDULUM, ij.Stop(ij.Restitution(R)))
    exact = np.asarray(ij.simulate(model, released, ts).position) * DEGREES
    chain = ij.piecewise_analytical(PENDULUM, ij.Restitution(R), released, max_impacts=8)
    formula = np.asarray(chain.position(ts)) * DEGREES
    above.plot(ts, exact, color=EXACT, linewidth=1.5, label="exact")
    above.plot(ts, formula, "--", color=FORMULA, linewidth=1, label="multiple scales, piecewise")
    above.set(ylabel="angle [deg]", xlim=(0, 1.5), ylim=(0, 48), xticklabels=[])
    above.legend(frameon=False)
    below.axhline(0, color="black", linewidth=0.5)
    below.plot(ts, formula - exact, color=FORMULA, linewidth=1)
    below.set(xlabel="time [s]", ylabel="difference [deg]", xlim=(0, 1.5))


def draw_restitution(ax: Axes) -> None:
    """Error of the restitution found from two peaks, against the first of them."""
    first = np.radians(np.geomspace(1.0, 150.0, 25))
    second = second_peaks(first)
    flights = {
        "multiple scales": (ij.MultipleScalesFlight(), FORMULA, (9, 0.3)),
        "exact flight": (ij.ExactFlight(), EXACT, (9, 2e-7)),
    }
    for label, (flight, colour, place) in flights.items():
        found = ij.successive_peaks(PENDULUM, first, second, flight=flight).restitution
        error = np.abs(np.asarray(found) / R - 1) * 100
        ax.loglog(first * DEGREES, error, ".-", color=colour, linewidth=1, markersize=4)
        ax.annotate(label, place, color=colour, ha="right")
    ax.axhline(0.002, color=GREY, linewidth=0.8, linestyle="--")
    ax.text(150, 0.0024, "0.002 %", color=GREY, ha="right")
    ax.set(xlabel="first peak [deg]", ylabel="error of the restitution [%]")
    ax.set(xticks=[1, 10, 100], xticklabels=["1", "10", "100"], xlim=(0.9, 180))


def second_peaks(first: np.ndarray) -> np.ndarray:
    """The peaks that follow an impact at r = 0.6, by a parabola through the highest samples."""
    ts = np.linspace(0.0, 1.0, 4001)
    model = ij.ImpactOscillator(PENDULUM, ij.Stop(ij.Restitution(R)))

    @jax.vmap
    def run(start: jax.Array) -> tuple[jax.Array, jax.Array]:
        motion = ij.simulate(model, ij.InitialState(start), ts)
        return motion.position, motion.impacts.time[:2]

    peaks = []
    for angle, (begin, end) in zip(*map(np.asarray, run(jnp.asarray(first))), strict=True):
        flight = np.where((ts > begin) & ((ts < end) | (end == 0)), angle, 0.0)
        top = int(np.argmax(flight))
        before, highest, after = flight[top - 1 : top + 2]
        peaks.append(highest + (after - before) ** 2 / (8 * (2 * highest - before - after)))
    return np.array(peaks)


if __name__ == "__main__":
    main()
