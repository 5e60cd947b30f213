"""Bias and coverage of Sobol indices of Ishigami's function, also with 5 % of the lanes failing.

    python benchmarks/sobol.py [--designs 100] [--blocks 1024]

For each index: the closed form, the mean error over many seeds in units of its own standard error,
and the share of 95 % intervals that hold the closed form.
"""

import argparse
import math
import tempfile
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij

jax.config.update("jax_enable_x64", True)

A, B = 7.0, 0.1
RANGES = dict.fromkeys("xyz", (-math.pi, math.pi))
PARTS = {
    "x": 0.5 * (1 + B * math.pi**4 / 5) ** 2,
    "y": A**2 / 8,
    "xz": 8 * B**2 * math.pi**8 / 225,
}
EXACT = {
    "first": np.array([PARTS["x"], PARTS["y"], 0.0]) / sum(PARTS.values()),
    "total": np.array([PARTS["x"] + PARTS["xz"], PARTS["y"], PARTS["xz"]]) / sum(PARTS.values()),
}


def lane(x, y, z):
    """Ishigami's function, and the same where a hash of the parameters lets 5 % fail."""
    value = jnp.sin(x) + A * jnp.sin(y) ** 2 + B * z**4 * jnp.sin(x)
    number = jnp.abs(jnp.sin(12.9898 * x + 78.233 * y + 37.719 * z)) * 43758.5453
    return {"all": value, "some": jnp.where(number % 1.0 < 0.05, jnp.nan, value)}


def main() -> None:
    """Prints a table for all lanes, and one for those that do not fail."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--designs", type=int, default=100)
    arguments.add_argument("--blocks", type=int, default=1024)
    given = arguments.parse_args()
    found = {"all": [], "some": []}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(given.designs):
            design = ij.Saltelli(RANGES, given.blocks, seed=seed)
            study = ij.study(lane, design, Path(folder) / f"{seed}", chunk=8192)
            whole = ij.study(
                lambda **point: lane(**point)["all"],
                design,
                Path(folder) / f"{seed}-all",
                chunk=8192,
            )
            found["all"].append(ij.sobol_indices(whole, "value", seed=seed))
            found["some"].append(ij.sobol_indices(study, "some", seed=seed))
    for which, each in found.items():
        used = np.mean([one.used for one in each])
        print(f"{which} lanes: {used:.0f} of {given.blocks} blocks used")
        for kind, exact in EXACT.items():
            values = np.array([getattr(one, kind) for one in each])
            widths = np.array([getattr(one, f"{kind}_error") for one in each])
            error = values.mean(axis=0) - exact
            scatter = values.std(axis=0, ddof=1)
            held = (np.abs(values - exact) <= widths).mean(axis=0)
            for i, name in enumerate("xyz"):
                print(
                    f"  {kind} {name}: exact {exact[i]:.4f}, mean error {error[i]:+.4f} = "
                    f"{error[i] / scatter[i] * math.sqrt(len(each)):+.1f} standard errors, "
                    f"one design ± {scatter[i]:.4f}, intervals hold {100 * held[i]:.0f} %"
                )


if __name__ == "__main__":
    main()
