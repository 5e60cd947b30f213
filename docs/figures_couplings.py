"""Makes the figure of couplings on identifiability.md: `python docs/figures_couplings.py`."""

import math
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
STOPS = (ij.Walton(k=1e4, c=2e3), ij.KelvinVoigt(727.5, 0.18), ij.HertzDashpot(1e6, 2.0))


def main() -> None:
    """Draws the bounds of three laws' parameters by measurement."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.2), sharey=True, layout="constrained")
    for ax, law in zip(axes, STOPS, strict=True):
        pendulum = ij.Pendulum(omega_n=13.0, zeta=0.02, length=0.071, mass=0.02)
        found = ij.couplings(
            ij.ImpactOscillator(pendulum, ij.Stop(law)),
            ij.InitialState(0.78),
            jnp.arange(1401) / 1000,
            forced=ij.HarmonicMotion(0.01, 2 * math.pi * 4.2),
        )
        print(found, flush=True)
        ij.plot.couplings(ax, found)
    figure.savefig(HERE / "figures" / "couplings.png", dpi=125)


if __name__ == "__main__":
    main()
