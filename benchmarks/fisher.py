"""Time and memory of many Fisher matrices of planned Kelvin-Voigt records.

    python benchmarks/fisher.py [--count 100000]

Five parameters, 1401 samples behind a low-pass of 50 Hz, random values of the model.
"""

import argparse
import resource
import time

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import impactjax as ij

jax.config.update("jax_enable_x64", True)

USUAL = np.array([13.0, 0.02, 600.0, 0.2, 0.78])
BATCH = 250


def matrix(values: Float[Array, " parameters"]) -> Float[Array, "parameters parameters"]:
    """The Fisher information of one experiment."""
    omega_n, zeta, omega0, gamma, theta0 = values
    pendulum = ij.Pendulum(omega_n=omega_n, zeta=zeta, length=0.071)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(omega0, gamma)))
    recording = ij.planned(jnp.arange(1401) / 1000, ij.Angle())
    sensor = ij.Sensor(low_pass=ij.Butterworth(50.0), sigma=0.0035)
    start = ij.InitialState(theta0)
    return ij.information(
        ij.Experiment(model, recording, start, sensor, fixed=("theta_dot0",))
    ).matrix


@jax.jit
def matrices(values: Float[Array, "lanes parameters"]) -> Float[Array, "lanes parameters others"]:
    """Fisher information of many experiments."""
    return jax.lax.map(matrix, values, batch_size=BATCH)


def main() -> None:
    """Prints seconds, the peak of memory, and the share of finite matrices."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=100_000)
    count = arguments.parse_args().count
    rng = np.random.default_rng(0)
    values = jnp.asarray(USUAL * rng.uniform(0.9, 1.1, (count, len(USUAL))))
    begin = time.perf_counter()
    program = matrices.lower(values).compile()
    compiled = time.perf_counter()
    found = np.asarray(program(values))
    seconds = time.perf_counter() - compiled
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    finite = np.isfinite(found).all(axis=(1, 2)).mean()
    print(
        f"compiled in {compiled - begin:.1f} s; {count} matrices in {seconds:.1f} s, "
        f"{peak:.2f} GiB, {100 * finite:.1f} % finite"
    )


if __name__ == "__main__":
    main()
