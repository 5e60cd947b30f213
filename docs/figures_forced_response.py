"""Makes the figure of the page on forced response: `python docs/figures_forced_response.py`."""

# ruff: noqa: ANN001, ANN201, ARG002, ARG005, D102  the system as it stands on the page

from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent


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


def amplitude(system):
    return system.amplitude


def main() -> None:
    """Branches of two frequencies, and a diagram of one of them."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    rest = ij.Start(0.0, {"x": -1.0, "v": 0.0})
    for frequency, first in ((0.81, 0.36), (0.799, 0.363)):
        mass = Mass(first, frequency)
        orbit = ij.periodic_orbit(mass, rest, Mass.period, multiple=2, settle=200)
        branch = ij.follow(orbit, amplitude, (0.34, 0.37), longest=0.02)
        ij.plot.branch(axes[0], branch, branch.before["v"][:, 0])
        for each in branch.special:
            if each.kind == "period doubling":
                double = ij.follow(ij.doubled(each.orbit), amplitude, (0.34, 0.37))
                for column in double.before["v"].T:
                    ij.plot.branch(axes[0], double, column)
    axes[0].annotate("ω = 0.81", (0.3585, 0.29))
    axes[0].annotate("ω = 0.799", (0.3605, 0.12), ha="right")
    axes[0].set(xlabel="amplitude A", ylabel="impact speed", ylim=(0, 0.4), xlim=(0.344, 0.364))
    values = np.linspace(0.3455, 0.349, 700)
    found = ij.diagram(Mass(0.35, 0.81), rest, Mass.period, amplitude, values, keep=64, skip=400)
    ij.plot.diagram(axes[1], found, found.states["x"])
    axes[1].set(xlabel="amplitude A", ylabel="x after each period of the force")
    figure.savefig(HERE / "figures" / "forced-response.png", dpi=125)


if __name__ == "__main__":
    main()
