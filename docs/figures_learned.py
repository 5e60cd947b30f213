"""Makes the figure of a learned law: `python docs/figures_learned.py`."""

from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import impactjax as ij

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
START, STEPS = ij.InitialState(0.0, 3.0), ij.Simulation(max_steps=128)


def main() -> None:
    """Learned restitution from 40 impacts of a ball, its true value, and named laws."""
    heard = recording()
    named = [ij.LinearRestitution(0.9, 0.03), ij.PowerRestitution(0.85, 0.05)]
    others = [ij.fit(ij.Experiment(ball(law), heard, START, simulation=STEPS)) for law in named]
    law = ij.LearnedRestitution.like(named[0], np.geomspace(0.2, 3.0, 10))
    learned = ij.learn(
        ij.Experiment(ball(law), heard, START, simulation=STEPS),
        where=lambda system: system.model.lower.law.weights,
    )
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
    ij.plot.learned_restitution(ax, learned, others)
    speeds = np.linspace(0.0, 3.3, 200)
    ax.plot(speeds, softening(speeds), "k--", linewidth=0.8, label="true law")
    ax.legend(frameon=False, fontsize="small")
    figure.savefig(HERE / "figures" / "learned-restitution.png", dpi=125)


def softening(v: np.ndarray) -> np.ndarray:
    """Restitution of a material that is elastic below 1.5 m/s and plastic above."""
    return 0.80 + 0.12 / (1 + (v / 1.5) ** 6)


def recording() -> ij.ImpactTimes:
    """40 impact times with a standard deviation of 0.1 ms."""
    times, speed = [0.3], np.array(3.0)
    for _ in range(39):
        times.append(times[-1] + 2 * float(speed) / 9.80665)
        speed = softening(speed) * speed
    return ij.ImpactTimes(jnp.array(times) + 1e-4 * np.random.default_rng(0).standard_normal(40))


def ball(law: ij.AbstractImpactLaw) -> ij.ImpactOscillator:
    """A ball on a floor."""
    return ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(law))


if __name__ == "__main__":
    main()
