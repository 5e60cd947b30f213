"""Makes the figure of the page on forced response: `python docs/figures_forced_response.py`."""

# ruff: noqa: ANN001, ANN201, ARG002, ARG005, D102  the system as it stands on the page

from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
REST = ij.Start(0.0, {"x": -1.0, "v": 0.0})


class Mass(ij.HybridSystem):
    """x″ + 0.04 x′ + x + 1 = A cos ωt, with a stop at x = 0 of restitution 0.9."""

    amplitude: float
    frequency: float

    def flow(self, t, y, mode):
        force = self.amplitude * jnp.cos(self.frequency * t)
        return {"x": y["v"], "v": force - 0.04 * y["v"] - y["x"] - 1}

    def transitions(self):
        return [ij.Transition(lambda t, y, mode: -y["x"], self.impact)]

    def impact(self, t, y, mode):
        return {**y, "v": -0.9 * y["v"]}, mode

    def period(self):
        return 2 * jnp.pi / self.frequency


def amplitude(system: Mass) -> float:
    """The parameter of the branches."""
    return system.amplitude


def main() -> None:
    """Branches at two frequencies, the doublings at one of them, and a diagram over the same."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.0), layout="constrained")
    for frequency, first in ((0.81, 0.36), (0.799, 0.363)):
        mass = Mass(first, frequency)
        orbit = ij.periodic_orbit(mass, REST, Mass.period, multiple=2, settle=200)
        branch = ij.follow(orbit, amplitude, (0.34, 0.37), longest=0.02)
        draw(axes[0], branch)
        if frequency == 0.81:
            draw(axes[1], branch)
            (doubling,) = [each for each in branch.special if each.kind == "period doubling"]
            draw(axes[1], ij.follow(ij.doubled(doubling.orbit), amplitude, (0.34, 0.37)))
    axes[0].annotate("ω = 0.81", (0.3478, 0.29))
    axes[0].annotate("ω = 0.799", (0.3615, 0.16), ha="right")
    axes[0].set(ylim=(0, 0.4), xlim=(0.3445, 0.3645))
    axes[1].set(ylim=(0, 0.13), xlim=(0.3452, 0.3492))
    for ax in axes[:2]:
        ax.set(xlabel="amplitude A", ylabel="impact speed")
    values = np.linspace(0.3492, 0.3452, 800)
    found = ij.diagram(
        *(Mass(0.35, 0.81), REST, Mass.period, amplitude, values),
        sweep=ij.WithMemory(),
        keep=64,
        skip=300,
    )
    ij.plot.diagram(axes[2], found, found.states["x"])
    axes[2].set(xlabel="amplitude A", ylabel="x after each period", xlim=(0.3452, 0.3492))
    for ax in axes:
        ax.locator_params(axis="x", nbins=5)
    figure.savefig(HERE / "figures" / "forced-response.png", dpi=125)


def draw(ax: Axes, branch: ij.Branch) -> None:
    """The speeds of all impacts of a branch."""
    for column in branch.before["v"].T:
        ij.plot.branch(ax, branch, column)


if __name__ == "__main__":
    main()
