"""Searches by `fit` beside Optimistix from the same starts: a Markdown table of evaluations.

python benchmarks/optimisers.py
"""

import statistics
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

import impactjax as ij

RECORD = Path(__file__).parent.parent / "data" / "kelvin_voigt.csv"
STARTS = [(w, o) for w in (10.0, 11.0, 12.0, 15.0, 17.0, 20.0) for o in (300.0, 600.0, 1500.0)]


def experiment(omega_n: float, omega0: float) -> ij.Experiment:
    pendulum = ij.Pendulum(omega_n=omega_n, zeta=0.002, length=0.071)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(omega0=omega0, gamma=0.2)))
    recording = ij.io.read_recording(RECORD).recording
    sensor = ij.Sensor(low_pass=ij.Butterworth(50.0))
    return ij.Experiment(model, recording, ij.InitialState(0.78), sensor)


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    problem = ij.build_problem(experiment(*STARTS[0]))
    solver = optx.LevenbergMarquardt(rtol=1e-8, atol=1e-8)

    @jax.jit
    def searched(u: jax.Array) -> tuple[jax.Array, jax.Array]:
        def residuals(u: jax.Array, args: None) -> jax.Array:
            del args
            return problem.residuals(problem.values(u))

        found = optx.least_squares(
            residuals, solver, u, options={"jac": "fwd"}, max_steps=300, throw=False
        )
        squares = jnp.sum(residuals(found.value, None) ** 2)
        return found.stats["num_steps"], jnp.sqrt(squares / problem.observations)

    print("| omega_n | omega0 | Optimistix | rms | fit | rms |\n|---|---|---|---|---|---|")
    counts = []
    for start in STARTS:
        own = experiment(*start)
        values = np.asarray(ij.build_problem(own).start)
        steps, rms = searched(jnp.asarray(problem.unbounded(values)))
        found = ij.fit(own)
        counts.append((int(steps), int(found.iterations)))
        row = f"| {start[0]:g} | {start[1]:g} | {counts[-1][0]} | {float(rms):.6f} |"
        print(f"{row} {counts[-1][1]} | {float(found.rms):.6f} |", flush=True)
    theirs, ours = (statistics.median(each) for each in zip(*counts, strict=True))
    print(f"| median | | {theirs:g} | | {ours:g} | |")


if __name__ == "__main__":
    main()
