"""Batches of simulations on the processor and on an accelerator, if there is one: a Markdown table.

    python benchmarks/accelerator.py [--sizes 4096 65536]

Each lane is a pendulum that hits a Kelvin-Voigt stop, over 0.7 s and some 60 steps; the Jacobian is
by three parameters. The last rows are the largest differences between both devices.
"""

import argparse
import time

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import impactjax as ij

jax.config.update("jax_enable_x64", True)

PENDULUM = ij.Pendulum(omega_n=13.0, zeta=0.02, length=0.071, mass=0.02)
LOW, HIGH = np.array([300.0, 0.05, 0.3]), np.array([1500.0, 0.4, 0.9])


def lane(values: Float[Array, "3"]) -> Float[Array, " samples"]:
    """The angle at eight instants."""
    omega0, gamma, theta0 = values
    model = ij.ImpactOscillator(PENDULUM, ij.Stop(ij.KelvinVoigt(omega0, gamma)))
    ts = jnp.linspace(0.0, 0.7, 8)
    return ij.simulate(model, ij.InitialState(theta0), ts, max_impacts=16).position


PROGRAMS = {"simulation": lane, "with Jacobian": jax.jacfwd(lane)}


def main() -> None:
    """Prints a row for each device, program and size."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--sizes", type=int, nargs="+", default=[4096, 65536])
    sizes = arguments.parse_args().sizes
    devices = [jax.devices("cpu")[0]]
    devices += [] if jax.default_backend() == "cpu" else [jax.devices()[0]]
    found: dict[tuple[str, int], list[np.ndarray]] = {}
    print("| device | program | lanes | first [s] | again [s] | lanes/s |")
    print("|---|---|---|---|---|---|")
    for device in devices:
        for name, program in PROGRAMS.items():
            batch = jax.jit(jax.vmap(program))
            for size in sizes:
                unit = np.random.default_rng(0).uniform(size=(size, 3))
                values = jax.device_put(jnp.asarray(LOW + (HIGH - LOW) * unit), device)
                seconds, results = [], []
                for _ in range(3):
                    begun = time.perf_counter()
                    results.append(np.asarray(batch(values)))
                    seconds.append(time.perf_counter() - begun)
                found.setdefault((name, size), []).append(results[-1])
                rate = size / seconds[-1]
                print(
                    f"| {device.platform} | {name} | {size} | {seconds[0]:.1f} | {seconds[-1]:.3f} "
                    f"| {rate:.0f} |",
                    flush=True,
                )
    for (name, size), results in found.items():
        largest = np.max(np.abs(results[0]))
        difference = np.max(np.abs(results[-1] - results[0])) / largest
        print(f"{name}, {size} lanes: relative difference {difference:.1e}")


if __name__ == "__main__":
    main()
