"""Makes the figures of profiles and ridges on profiles.md: `python docs/figures_profiles.py`."""

from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent


def ridge_of(law: ij.AbstractForceLaw, points: tuple[int, int]) -> ij.Ridge:
    """The ridge of stiffness and damping in positions before and after one impact at 1 m/s, known
    to 2 mm: they tell the restitution well, and the duration of the contact roughly.
    """
    model = ij.ImpactOscillator(ij.FreeMass(mass=0.02), ij.Stop(law))
    instants = jnp.concatenate([jnp.linspace(0.0, 0.19, 20), jnp.linspace(0.24, 0.43, 20)])
    plan = ij.Experiment(
        model,
        ij.planned(instants, ij.Displacement()),
        ij.InitialState(0.2, -1.0),
        ij.Sensor(sigma=2e-3),
        simulation=ij.Simulation(max_steps=256, max_impacts=4),
        noise=ij.WhiteNoise(),
    )
    estimate = ij.fit(ij.synthetic(plan, jax.random.key(1)))
    print(estimate, flush=True)
    return ij.ridge(estimate, "k", "c", points=points)


def main() -> None:
    """Draws the ridges of two laws."""
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    cases = ((ij.Walton(1e4, 3e3), 1.0, "c ∝ k"), (ij.HertzDashpot(1e6, 1.0), 0.4, "c ∝ k^(2/5)"))
    for ax, (law, power, words) in zip(axes, cases, strict=True):
        found = ridge_of(law, (60, 30))
        k, c = found.best
        ij.plot.ridge(ax, found, theory=lambda x, k=k, c=c, power=power: c * (x / k) ** power)
        ax.set_title(f"{type(law).__name__}: theory {words}", fontsize="medium")
    figure.savefig(HERE / "figures" / "ridges.png", dpi=125)


if __name__ == "__main__":
    main()
