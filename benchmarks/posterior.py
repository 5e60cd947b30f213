"""Speed and convergence of the posterior of a Kelvin-Voigt record, and its agreement with profiles.

    python benchmarks/posterior.py [--draws 1000] [--samples 1401] [--cutoff 100]

Four parameters (omega_n, zeta, omega0, gamma), a pendulum released at 0.78 rad, noise of 0.0035 rad
and of unknown size; white, or behind a low-pass with a cutoff in Hz, so that it is correlated.
"""

import argparse
import time

import jax
import jax.numpy as jnp
import numpy as np
from arviz_stats.base.array import array_stats
from scipy import signal

import impactjax as ij

jax.config.update("jax_enable_x64", True)

WARMUP = 500


def record(samples: int, cutoff: float | None) -> ij.Experiment:
    """A simulated record of 1.4 s with six impacts, the noise of which has a cutoff."""
    pendulum = ij.Pendulum(13.0, 0.02, length=0.071)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(600.0, 0.2)))
    start, ts = ij.InitialState(0.78), jnp.linspace(0.0, 1.4, samples)
    noise = np.random.default_rng(0).standard_normal(samples)
    if cutoff is not None:
        sections = signal.butter(2, cutoff, fs=(samples - 1) / 1.4, output="sos")
        noise = np.asarray(signal.sosfilt(sections, noise))
    noise *= 0.0035 / np.std(noise)
    angle = ij.simulate(model, start, ts).position + noise
    recording = ij.Recording(ts, angle, ij.Angle())
    return ij.Experiment(model, recording, start, fixed=("theta0", "theta_dot0"))


def main() -> None:
    """Prints seconds, effective sample sizes a second, and both intervals of each parameter."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--draws", type=int, default=1000)
    arguments.add_argument("--samples", type=int, default=1401)
    arguments.add_argument("--cutoff", type=float)
    given = arguments.parse_args()
    estimate = ij.profiled(ij.fit(record(given.samples, given.cutoff)))
    clocks = []

    def note(done: int, whole: int) -> None:
        del whole
        clocks.append((done, time.perf_counter(), time.process_time()))

    begin = time.perf_counter()
    tree = ij.posterior(estimate, given.draws, warmup=WARMUP, progress=note)
    (chunk, compiled, _), (whole, end, _) = clocks[0], clocks[-1]
    warm = next(each for each in clocks if each[0] >= WARMUP)
    sampling, computing = end - warm[1], clocks[-1][2] - warm[2]
    found = {name: np.asarray(tree["posterior"].dataset[name]) for name in estimate.names}
    sizes = {name: float(np.asarray(array_stats.ess(each))) for name, each in found.items()}
    steps = float(np.mean(tree["sample_stats"].dataset["n_steps"]))
    print(f"errors inflated by {np.round(np.asarray(estimate.inflation), 2)} for correlation")
    print(tree.attrs["diagnosis"])
    least = min(sizes.values())
    print(
        f"first {chunk} transitions with compiling {compiled - begin:.1f} s; all {whole}: "
        f"{end - begin:.1f} s; {steps:.1f} evaluations a draw"
    )
    print(
        f"effective sample size: {least / sampling:.0f} a second while drawing, "
        f"{least / computing:.0f} a second of CPU time, "
        f"{least / (end - compiled):.0f} a second with warm-up (least of the parameters)"
    )
    for name, size in sizes.items():
        own, (low, high) = estimate[name], np.quantile(found[name], [0.025, 0.975])
        print(
            f"{name}: profile {own.low:.6g} to {own.high:.6g}, posterior {low:.6g} to {high:.6g}, "
            f"width ratio {(high - low) / (own.high - own.low):.3f}, effective {size:.0f}"
        )


if __name__ == "__main__":
    main()
