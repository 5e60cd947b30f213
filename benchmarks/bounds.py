"""Bounds before a measurement against the spread of fits to simulated recordings: a Markdown table.

    python benchmarks/bounds.py [--law walton] [--count 1000] [--scatter 0.005]

Each recording is the thesis's pendulum at 1 kHz behind a low-pass of 50 Hz with 0.2 deg of noise.
Columns: the Cramér-Rao bound by `information`, the standard deviation of the fitted values, and
their ratio, which is near one where the bound can be trusted.
"""

import argparse
import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij

jax.config.update("jax_enable_x64", True)

LAWS = {
    "kelvin-voigt": ij.KelvinVoigt(600.0, 0.2),
    "hunt-crossley": ij.HuntCrossley(k=1e6, c=0.3),
    "walton": ij.Walton(k=7200.0, c=2500.0),
}
CHUNK = 50  # fits in one batch
SIGMA = math.radians(0.2)


def experiment(law: ij.AbstractForceLaw) -> ij.Experiment:
    """A planned recording of a pendulum that hits a stop."""
    pendulum = ij.Pendulum(omega_n=13.0, zeta=0.02, length=0.071, mass=0.02)
    return ij.Experiment(
        ij.ImpactOscillator(pendulum, ij.Stop(law)),
        ij.planned(jnp.arange(1401) * 1e-3, ij.Angle()),
        ij.InitialState(0.78),
        ij.Sensor(low_pass=ij.Butterworth(50.0), sigma=SIGMA),
    )


def refitted(plan: ij.Experiment, count: int, scatter: float) -> ij.Estimate[ij.Problem]:
    """Fits to simulated recordings."""

    own = ij.NormalScatter() if scatter > 0 else ij.NoScatter()

    def one(key: jax.Array) -> ij.Estimate[ij.Problem]:
        drawn = ij.synthetic(plan, key, scatter=scatter)
        return ij.fit(dataclasses.replace(drawn, scatter=own))

    keys = jax.random.split(jax.random.key(0), count)
    return jax.tree.map(np.asarray, jax.lax.map(one, keys, batch_size=CHUNK))


def main() -> None:
    """Prints a row for each parameter of each law."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--law", choices=LAWS, action="append")
    arguments.add_argument("--count", type=int, default=1000)
    arguments.add_argument("--scatter", type=float, default=0.0)
    asked = arguments.parse_args()
    print(
        "| law | parameter | identified | bound | spread of fits | bound / spread | bias / bound |"
    )
    print("|---|---|---|---|---|---|---|")
    for name in asked.law or LAWS:
        plan = experiment(LAWS[name])
        told = ij.information(plan, scatter=asked.scatter)
        fits = refitted(plan, asked.count, asked.scatter)
        good = fits.outcome == ij.Outcome.CONVERGED
        for i, own in enumerate(told.names):
            values = fits.values[good, i]
            spread = np.std(values, ddof=1)
            bound = float(told.bounds[i])
            bias = float(np.mean(values) - told.values[i])
            identified = np.mean(fits.verdicts[good, i] == ij.Verdict.IDENTIFIED)
            print(
                f"| {name}, {good.sum()} fits | {own} | {identified:.2f} | {bound:.4g} "
                f"| {spread:.4g} | {bound / spread:.3f} | {bias / bound:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
