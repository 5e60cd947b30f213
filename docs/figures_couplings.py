"""Makes the figures of the laws on couplings.md: `python docs/figures_couplings.py`."""

import math
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
LAWS = {
    "restitution": ij.Restitution(0.6),
    "linear-restitution": ij.LinearRestitution(r0=0.7, alpha=0.2),
    "power-restitution": ij.PowerRestitution(r0=0.6, alpha=0.1),
    "kelvin-voigt": ij.KelvinVoigt(omega0=727.5, gamma=0.18),
    "kelvin-voigt-linear-restitution": ij.KelvinVoigtLinearRestitution(727.5, r0=0.7, alpha=0.2),
    "maxwell": ij.Maxwell(omega0=727.5, gamma=0.18),
    "walton": ij.Walton(k=1e4, c=2e3),
    "hertz": ij.Hertz(k=1e6),
    "simon": ij.Simon(k=1e6, c=0.3),
    "hunt-crossley": ij.HuntCrossley(k=1e6, c=0.3, n=1.4),
    "pust-peterka": ij.PustPeterka(k=1e6, alpha=0.3, q=2.0),
    "hertz-dashpot": ij.HertzDashpot(k=1e6, c=2.0),
    "power-law": ij.PowerLaw(k=1e6, c=2e4, n=1.5, p=1.0, q=1.2),
}


def main() -> None:
    """Draws the bounds of each law's parameters by measurement, all on one scale."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    pendulum = ij.Pendulum(omega_n=13.0, zeta=0.02, length=0.071, mass=0.02)
    forced = ij.HarmonicMotion(0.01, 2 * math.pi * 4.2)
    (HERE / "figures" / "couplings").mkdir(exist_ok=True)
    for name, law in LAWS.items():
        model = ij.ImpactOscillator(pendulum, ij.Stop(law))
        times = jnp.arange(1401) / 1000
        found = ij.couplings(
            *(model, ij.InitialState(0.78), times),
            forced=forced,
            simulation=ij.Simulation(max_steps=1024),
        )
        print(found, flush=True)
        rows = len(found.bounds)
        figure, ax = plt.subplots(figsize=(7.5, 0.9 + 0.24 * rows), layout="constrained")
        ij.plot.couplings(ax, found).set_xlim(5e-4, 1)
        figure.savefig(HERE / "figures" / "couplings" / f"{name}.png", dpi=110)
        plt.close(figure)


if __name__ == "__main__":
    main()
