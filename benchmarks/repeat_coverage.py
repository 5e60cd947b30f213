"""Coverage of 95 % intervals over repeats of one experiment: a Markdown table.

    python benchmarks/repeat_coverage.py [--count 500] [--fits 0]

Results with known errors, by the random-effects model alone. With `--fits`, so many series of
bounce times as well, by the closed form of a ball whose restitution scatters from impact to impact
and from repeat to repeat; each recording is fitted by `compare`.
"""

import argparse

import jax
import numpy as np

import impactjax as ij
from impactjax._fit.random_effects import random_effects

jax.config.update("jax_enable_x64", True)

RESTITUTION, BOUNCES, CLOCK, SCATTER = 0.85, 12, 1e-4, 0.004


def of_results(count: int, repeats: int, between: float) -> str:
    """A row on results whose errors are known; `between` is the scatter in typical errors."""
    rng, held, single = np.random.default_rng(1), 0, 0
    for _ in range(count):
        errors = rng.uniform(0.7, 1.4, repeats)
        found = random_effects(rng.normal(0.0, np.hypot(errors, between)), errors)
        held += found.low <= 0 <= found.high
        single += found.single_low <= rng.normal(0.0, between) <= found.single_high
    return f"| results | {repeats} | {between:g} | {held / count:.3f} | {single / count:.3f} |"


def of_fits(count: int, repeats: int, between: float) -> str:
    """A row on the whole way from bounce times to the mean restitution."""
    rng, held, single = np.random.default_rng(2), 0, 0
    for _ in range(count):
        own = RESTITUTION + between * rng.standard_normal(repeats)
        comparisons = [_compared(rng, r) for r in own]
        found = ij.repeatability(comparisons)["restitution"]["r"]
        held += found.low <= RESTITUTION <= found.high
        another = RESTITUTION + between * rng.standard_normal()
        single += found.over.single_low <= another <= found.over.single_high
    return f"| bounce times | {repeats} | {between:g} | {held / count:.3f} | {single / count:.3f} |"


def _compared(rng: np.random.Generator, restitution: float) -> ij.Comparison:
    logs = np.log(restitution) + SCATTER * rng.standard_normal(BOUNCES - 2)
    speeds = rng.uniform(2.5, 3.5) * np.exp(np.concatenate([[0.0], np.cumsum(logs)]))
    times = np.concatenate([[0.0], np.cumsum(2 * speeds / 9.80665)])
    recorded = ij.ImpactTimes(times + CLOCK * rng.standard_normal(BOUNCES))
    return ij.compare(ij.prepare(recorded, laws=["restitution"]))


def main() -> None:
    """Prints the table."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=500)
    arguments.add_argument("--fits", type=int, default=0)
    asked = arguments.parse_args()
    print("| of | repeats | scatter between them | mean held | single repeat held |")
    print("|---|---|---|---|---|")
    for repeats in (2, 3, 5, 10):
        for between in (0.0, 0.5, 1.0, 2.0, 5.0, 20.0):
            print(of_results(asked.count, repeats, between), flush=True)
    for repeats in (3, 5) if asked.fits else ():
        for between in (0.0, 0.003):
            print(of_fits(asked.fits, repeats, between), flush=True)


if __name__ == "__main__":
    main()
