"""Basins of attraction of the forced pendulum of the page on forced response.

    python benchmarks/basins.py [--side 100]

Times are those of the first call, with compiling, and of the second one, with the
compiler's options of the command.
"""

import argparse
import os
import time

import jax
import numpy as np

import impactjax as ij
from impactjax._cli.compiler_flags import FAST

os.environ.setdefault("XLA_FLAGS", FAST)  # read before the first computation
jax.config.update("jax_enable_x64", True)


def main() -> None:
    """Prints a line for each call."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--side", type=int, default=100, help="starts along an axis")
    side = arguments.parse_args().side
    base = ij.HarmonicMotion(4e-3, 2 * np.pi * 9)
    pendulum = ij.Pendulum(13.47, zeta=0.05, length=0.071, base=base)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(725.0, 0.16), gap=0.2))
    grid = np.meshgrid(np.linspace(-0.19, 1.5, side), np.linspace(-15, 15, side))
    starts = ij.InitialState(*(each.ravel() for each in grid))
    for call in ("first", "second"):
        wall, processor = time.perf_counter(), time.process_time()
        found = ij.basins(model, starts, 1 / 9)
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        shares = ", ".join(f"period {each.period}: {each.share:.1%}" for each in found.attractors)
        print(f"{call} call: {wall:.1f} s, {processor:.1f} CPU s; {shares}", flush=True)


if __name__ == "__main__":
    main()
