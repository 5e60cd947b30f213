"""Whether the estimates are as good as the noise allows: many recordings of one truth, fitted.

    python benchmarks/efficiency.py [--count 1000]

A JSON line a law of the tasks (`rivals/tasks.py`): for each parameter the variance of the estimates
over the Cramér-Rao bound, the same for the covariance as a whole (tr(C F) / n; 1 is efficient),
what chance alone makes of both (two standard errors), and the time of a fit.
"""

import argparse
import json
import os
import time
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

import impactjax as ij
import ours
from rivals import tasks

START = 1.02  # times the truth


def _estimate(law: str, values: Array) -> tuple[Array, Array]:
    """The estimates from one recording, and whether the fit converged."""
    recording = ij.Recording(jnp.asarray(tasks.TIMES), values, ij.Angle())
    guess = jnp.asarray(tasks.parameters(law)) * START
    fitted = ij.fit(
        ij.Experiment(
            ours.model(law, guess),
            recording,
            ij.InitialState(guess[-1]),
            fixed=("theta_dot0",),
            simulation=ij.Simulation(ours.TOLERANCE, ours.STEPS, ours.IMPACTS, ours.STEP),
        )
    )
    found = jnp.stack([fitted.value(name) for name in tasks.NAMES[law]])
    return found, fitted.converged


def _bound(law: str) -> np.ndarray:
    """The Cramér-Rao bound of the covariance, from exact derivatives."""
    truth = jnp.asarray(tasks.parameters(law))
    sensitivities = np.asarray(jax.jit(lambda p: ours.derivatives(law, p))(truth)) / tasks.NOISE
    return np.linalg.inv(sensitivities @ sensitivities.T)


def study(law: str, count: int, seed: int = 0) -> dict[str, PyTree]:
    """Fits `count` recordings of one truth and compares the spread of the estimates."""
    truth = jnp.asarray(tasks.parameters(law))
    clean = jax.jit(lambda p: ours.angles(law, p))(truth)
    noise = tasks.NOISE * np.random.default_rng(seed).standard_normal((count, len(tasks.TIMES)))
    recordings = clean + jnp.asarray(noise)
    compiled = jax.jit(jax.vmap(partial(_estimate, law))).lower(recordings).compile()
    begin = time.perf_counter()
    found, converged = (np.asarray(x) for x in compiled(recordings))
    seconds = time.perf_counter() - begin
    covariance, bound = np.cov(found[converged].T), _bound(law)
    variances = np.diag(covariance) / np.diag(bound)
    by_name = dict(zip(tasks.NAMES[law], variances.round(4).tolist(), strict=True))
    whole = np.trace(np.linalg.solve(bound, covariance)) / len(bound)
    chance = np.sqrt(2 / (converged.sum() - 1))
    return {
        "law": law,
        "count": count,
        "converged": int(converged.sum()),
        "variance_over_bound": by_name,
        "chance_a_parameter": round(2 * chance, 4),
        "covariance_over_bound": round(float(whole), 4),
        "chance_of_the_whole": round(2 * chance / np.sqrt(len(bound)), 4),
        "ms_a_fit": round(seconds / count * 1e3, 3),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Efficiency of the estimates.")
    parser.add_argument("--count", type=int, default=1000)
    arguments = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    for law in tasks.NAMES:
        print(json.dumps({**study(law, arguments.count), "cores": cores}), flush=True)


if __name__ == "__main__":
    main()
