"""Coverage of 95 % intervals from bounce times with restitution that scatters: a Markdown table.

    python benchmarks/scatter_coverage.py [--count 400] [--bounces 12 --bounces 30] [--without]

The times follow from the closed form of a bouncing ball, with the speed after each impact times
exp(s ξ), and normal errors of the clock. ξ is normal, or a two-sided exponential of variance 1.
Columns: share of intervals that hold the true restitution, first speed and scatter; half-width and
spread of the estimated restitution; share of "identified". `--without` fits no scatter.
"""

import argparse
import itertools
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij

jax.config.update("jax_enable_x64", True)

GRAVITY, RESTITUTION, SPEED = 9.80665, 0.9, 3.0
SCATTERS = (0.0, 0.002, 0.005, 0.01, 0.02)
CLOCKS = (20e-6, 0.1e-3, 0.5e-3)  # [s]
CHUNK = 100  # fits in one call


def bounce_times(
    rng: np.random.Generator, bounces: int, scatter: float, clock: float, exponential: bool
) -> np.ndarray:
    """Recorded times of one ball [s]."""
    heavy = rng.laplace(0.0, np.sqrt(0.5), bounces - 2)
    steps = heavy if exponential else rng.standard_normal(bounces - 2)
    logs = np.concatenate([[0.0], np.cumsum(np.log(RESTITUTION) + scatter * steps)])
    flights = 2 * SPEED * np.exp(logs) / GRAVITY
    times = np.concatenate([[0.0], np.cumsum(flights)])
    return times + clock * rng.standard_normal(bounces)


@eqx.filter_jit
@eqx.filter_vmap(in_axes=(0, None))
def fitted(times: jax.Array, scatter: ij.AbstractScatter) -> ij.Estimate[ij.Problem]:
    """The fit of one record."""
    ball = ij.BouncingBall(GRAVITY)
    model = ij.ImpactOscillator(ball, ij.Stop(ij.Restitution(RESTITUTION)))
    few = ij.Simulation(max_steps=128)
    recording, start = ij.ImpactTimes(times), ij.InitialState(0.0, SPEED)
    return ij.fit(ij.Experiment(model, recording, start, scatter=scatter, simulation=few))


def row(
    fit_scatter: ij.AbstractScatter,
    count: int,
    bounces: int,
    scatter: float,
    clock: float,
    exponential: bool,
) -> str:
    """One row of the table."""
    seed = np.random.SeedSequence([bounces, round(1e6 * scatter), round(1e7 * clock), exponential])
    rng = np.random.default_rng(seed)
    records = [bounce_times(rng, bounces, scatter, clock, exponential) for _ in range(count)]
    rising = np.array([each for each in records if np.all(np.diff(each) > 0)])
    parts = [rising[i : i + CHUNK] for i in range(0, len(rising), CHUNK)]
    padded = [np.resize(part, (CHUNK, bounces)) for part in parts]
    found = [jax.tree.map(np.asarray, fitted(jnp.asarray(part), fit_scatter)) for part in padded]
    all_fits = jax.tree.map(lambda *x: np.concatenate(x)[: len(rising)], *found)
    names = all_fits.problem.names
    r, v = names.index("r"), names.index("x_dot0")
    truth = {r: RESTITUTION, v: SPEED}
    inside = {i: (all_fits.low[:, i] <= x) & (x <= all_fits.high[:, i]) for i, x in truth.items()}
    size, told = all_fits.scatter, np.nan
    if size is not None:
        told = np.mean((size.low <= scatter) & (scatter <= size.high))
    half = np.median(all_fits.high[:, r] - all_fits.low[:, r]) / 2
    identified = np.mean(all_fits.verdicts[:, r] == ij.Verdict.IDENTIFIED)
    kind = "exponential" if exponential else "normal"
    return (
        f"| {bounces} | {100 * scatter:.1f} % | {1e3 * clock:g} ms | {kind} "
        f"| {np.mean(inside[r]):.3f} | {np.mean(inside[v]):.3f} | {told:.3f} "
        f"| {half:.5f} | {1.96 * all_fits.values[:, r].std():.5f} | {identified:.2f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--bounces", type=int, action="append")
    parser.add_argument("--without", action="store_true")
    asked = parser.parse_args()
    fit_scatter = ij.NoScatter() if asked.without else ij.NormalScatter()
    print(
        "| bounces | scatter | clock | ξ | r | speed | s | half-width | 1.96 spread | identified |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for bounces in asked.bounces or (6, 12, 30):
        cases = [(*each, False) for each in itertools.product(SCATTERS, CLOCKS)]
        cases += [(scatter, 0.1e-3, True) for scatter in (0.005, 0.01)]
        for case in cases:
            print(row(fit_scatter, asked.count, bounces, *case), flush=True)
            print(f"{bounces} bounces, {case} done", file=sys.stderr)


if __name__ == "__main__":
    main()
