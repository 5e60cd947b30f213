"""Whether intervals keep their promise: many simulated recordings with random truths, fitted again.

    python benchmarks/interval_coverage.py [--law kelvin-voigt] [--count 200] [--starts 1.5]
        [--noise white|filtered]

A JSON line a law: for each parameter, the share of 95 % intervals that hold the truth among the
fits whose verdict on it is "identified", how many these are, the share among all fits, and that of
errors that take the residuals as independent; the share of fits that end at the optimum found from
the truth; and the time of a fit.
"""

import argparse
import json
import os
import time
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

import impactjax as ij
from impactjax._cli.compiler_flags import FAST

os.environ.setdefault("XLA_FLAGS", FAST)  # read before the first computation
jax.config.update("jax_enable_x64", True)

TIMES = np.arange(1401) / 1000
NOISE = np.radians(0.2)
LENGTH, MASS = 0.071, 0.020
SAME = 1.01  # costs within this factor are the same optimum
MANY = 1024  # steps, where they are by Runge and Kutta

Law = ij.AbstractImpactLaw | ij.AbstractForceLaw


class Case(NamedTuple):
    """A law from its parameters, and the ranges from which these are drawn."""

    make: Callable[..., Law]
    names: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    steps: int = 256


CASES = {
    "restitution": Case(ij.Restitution, ("r",), (0.4,), (0.8,)),
    "linear-restitution": Case(ij.LinearRestitution, ("r0", "alpha"), (0.55, 0.05), (0.8, 0.3)),
    "power-restitution": Case(ij.PowerRestitution, ("r0", "alpha"), (0.5, 0.05), (0.7, 0.2)),
    "kelvin-voigt": Case(ij.KelvinVoigt, ("omega0", "gamma"), (300.0, 0.08), (900.0, 0.25)),
    "kelvin-voigt-linear-restitution": Case(
        ij.KelvinVoigtLinearRestitution,
        ("omega0", "r0", "alpha"),
        (300.0, 0.55, 0.05),
        (900.0, 0.8, 0.3),
    ),
    "maxwell": Case(ij.Maxwell, ("omega0", "gamma"), (300.0, 0.08), (900.0, 0.25)),
    "walton": Case(ij.Walton, ("k", "c"), (3e3, 3e3), (2e4, 2e4), MANY),
    "hertz": Case(ij.Hertz, ("k",), (5e4,), (5e5,), MANY),
    "simon": Case(ij.Simon, ("k", "c"), (5e4, 0.6), (5e5, 2.4), MANY),
    "hunt-crossley": Case(ij.HuntCrossley, ("k", "c"), (5e4, 0.6), (5e5, 2.4), MANY),
    "hertz-dashpot": Case(ij.HertzDashpot, ("k", "c"), (5e4, 1.5), (5e5, 5.0), MANY),
    "pust-peterka": Case(
        lambda k, alpha: ij.PustPeterka(k, alpha, 1.5), ("k", "alpha"), (5e4, 0.8), (5e5, 3.0), MANY
    ),
    "power-law": Case(  # Tsuji's exponents
        lambda k, c: ij.PowerLaw(k, c, 1.5, 0.25, 1.0), ("k", "c"), (5e4, 8.0), (2e5, 25.0), MANY
    ),
}
COMMON_LOW = np.array([12.0, 0.001, 0.6])
COMMON_HIGH = np.array([15.0, 0.004, 0.9])


def model(case: Case, p: Array) -> ij.ImpactOscillator:
    """A pendulum from ω_n, ζ, the start angle and the law's parameters."""
    pendulum = ij.Pendulum(p[0], p[1], length=LENGTH, mass=MASS)
    return ij.ImpactOscillator(pendulum, ij.Stop(case.make(*p[3:])))


SENSOR = ij.Sensor(low_pass=ij.Butterworth(50.0))


def recorded(case: Case, p: Array, noise: Array) -> ij.Recording:
    """What the sensor shows, with noise."""
    ts = jnp.asarray(TIMES)
    run = ij.simulate(
        model(case, p), ij.InitialState(p[2]), ts, tolerance=1e-10, max_steps=2 * case.steps
    )
    shown = SENSOR.shown(model(case, p), run, ij.Angle())
    return ij.Recording(ts, shown + noise, ij.Angle())


def fitted(case: Case, recording: ij.Recording, start: Array) -> ij.Estimate[ij.Problem]:
    return ij.fit(
        ij.Experiment(
            model(case, start),
            recording,
            ij.InitialState(start[2]),
            sensor=SENSOR,
            fixed=("theta_dot0",),
            simulation=ij.Simulation(max_steps=case.steps, max_impacts=32),
        )
    )


def noises(kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
    """White noise, or white noise that went through the sensor's low-pass, of the same size."""
    white = rng.standard_normal((count, len(TIMES) + 1000))
    if kind == "filtered":
        from scipy import signal

        sections = signal.butter(2, 50.0, fs=1000.0, output="sos")
        white = np.asarray(signal.sosfilt(sections, white, axis=1))
        white = white / white.std()
    return NOISE * white[:, 1000:]


def study(name: str, count: int, kind: str, factor: float, seed: int = 0) -> dict[str, PyTree]:
    case = CASES[name]
    rng = np.random.default_rng(seed)
    low = np.concatenate([COMMON_LOW, case.low])
    high = np.concatenate([COMMON_HIGH, case.high])
    truth = low + (high - low) * rng.random((count, len(low)))
    away = factor ** rng.uniform(-1, 1, truth.shape)
    away[:, [0, 2]] = 1 + 0.02 * rng.uniform(-1, 1, (count, 2))  # seen at once in any record
    bounded = np.isin(np.arange(len(low)), [3 + i for i, n in enumerate(case.names) if n[0] == "r"])
    start = np.where(bounded, np.minimum(truth * away, 0.99), truth * away)
    data = jnp.asarray(truth), jnp.asarray(noises(kind, count, rng)), jnp.asarray(start)

    def one(p: Array, noise: Array, start: Array) -> tuple[PyTree, ...]:
        recording = recorded(case, p, noise)
        best, found = fitted(case, recording, p), fitted(case, recording, start)
        return (
            found.values,
            found.low,
            found.high,
            found.standard_errors,
            found.inflation,
            found.verdicts,
            found.rms / best.rms,
            found.converged,
            found.memory,
        )

    compiled = jax.jit(jax.vmap(one)).lower(*data).compile()
    begin = time.perf_counter()
    out = [np.asarray(x) for x in jax.block_until_ready(compiled(*data))]
    seconds = time.perf_counter() - begin
    values, lows, highs, errors, inflation, verdicts, ratio, converged, memory = out
    names = jax.eval_shape(lambda d: fitted(case, recorded(case, d[0][0], d[1][0]), d[2][0]), data)
    order = ["omega_n", "zeta", "theta0", *case.names]
    parameters = {}
    for i, parameter in enumerate(names.names):
        true = truth[:, order.index(parameter)]
        counts = (verdicts[:, i] == ij.Verdict.IDENTIFIED) & converged
        inside = (lows[:, i] <= true) & (true <= highs[:, i])
        plain = np.abs(values[:, i] - true) <= 1.96 * errors[:, i] / inflation[:, i]
        parameters[parameter] = {
            "identified": int(counts.sum()),
            "covered": round(float(inside[counts].mean()), 4) if counts.any() else None,
            "covered_of_all": round(float(inside.mean()), 4),
            "covered_if_white": round(float(plain[counts].mean()), 4) if counts.any() else None,
        }
    return {
        "law": name,
        "noise": kind,
        "count": count,
        "start_factor": factor,
        "same_optimum": round(float(np.mean(ratio < np.sqrt(SAME))), 4),
        "converged": round(float(converged.mean()), 4),
        "memory": float(np.median(memory)),
        "ms_a_fit": round(seconds / count / 2 * 1e3, 2),
        "parameters": parameters,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Coverage of intervals.")
    parser.add_argument("--law", choices=sorted(CASES), action="append")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--noise", choices=("white", "filtered"), default="white")
    parser.add_argument("--starts", type=float, default=1.5, help="factor away from the truth")
    arguments = parser.parse_args()
    for name in arguments.law or CASES:
        result = study(name, arguments.count, arguments.noise, arguments.starts)
        print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main()
