"""Speed and convergence of the posterior of a Kelvin-Voigt record, and its agreement with profiles.

    python benchmarks/posterior.py [--draws 1000] [--samples 1401]

Four parameters (omega_n, zeta, omega0, gamma), a pendulum released at 0.78 rad, white noise of
0.0035 rad and of unknown size.
"""

import argparse
import time

import jax
import jax.numpy as jnp
import numpy as np
from arviz_stats.base.array import array_stats

import impactjax as ij

jax.config.update("jax_enable_x64", True)

WARMUP = 500


def record(samples: int) -> ij.Experiment:
    """A simulated record of 1.4 s with six impacts."""
    pendulum = ij.Pendulum(13.0, 0.02, length=0.071)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(600.0, 0.2)))
    start, ts = ij.InitialState(0.78), jnp.linspace(0.0, 1.4, samples)
    noise = 0.0035 * np.random.default_rng(0).standard_normal(samples)
    angle = ij.simulate(model, start, ts).position + noise
    recording = ij.Recording(ts, angle, ij.Angle())
    return ij.Experiment(model, recording, start, fixed=("theta0", "theta_dot0"))


def main() -> None:
    """Prints seconds, effective sample sizes a second, and both intervals of each parameter."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--draws", type=int, default=1000)
    arguments.add_argument("--samples", type=int, default=1401)
    given = arguments.parse_args()
    estimate = ij.profiled(ij.fit(record(given.samples)))
    begin, first = time.perf_counter(), []
    tree = ij.posterior(
        estimate,
        given.draws,
        warmup=WARMUP,
        progress=lambda done, _: first.append((done, time.perf_counter() - begin)),
    )
    (chunk, compiled), (whole, seconds) = first[0], first[-1]
    rate = (whole - chunk) / (seconds - compiled)
    sampling = given.draws / rate
    found = {name: np.asarray(tree["posterior"].dataset[name]) for name in estimate.names}
    sizes = {name: float(np.asarray(array_stats.ess(each))) for name, each in found.items()}
    steps = float(np.mean(tree["sample_stats"].dataset["n_steps"]))
    print(tree.attrs["diagnosis"])
    print(
        f"first {chunk} transitions with compiling {compiled:.1f} s; all {whole}: {seconds:.1f} s; "
        f"{steps:.1f} evaluations a draw"
    )
    least = min(sizes.values())
    print(
        f"effective sample size a second: {least / sampling:.0f} while drawing, "
        f"{least / (seconds - compiled + chunk / rate):.0f} with warm-up (least of the parameters)"
    )
    for name, size in sizes.items():
        own, (low, high) = estimate[name], np.quantile(found[name], [0.025, 0.975])
        print(
            f"{name}: profile {own.low:.6g} to {own.high:.6g}, posterior {low:.6g} to {high:.6g}, "
            f"width ratio {(high - low) / (own.high - own.low):.3f}, effective {size:.0f}"
        )


if __name__ == "__main__":
    main()
