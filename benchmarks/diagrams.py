"""Bifurcation diagrams and Lyapunov exponents of the forced pendulum over its frequency.

    python benchmarks/diagrams.py [--frequencies 2400]

The amplitudes are those of the thesis's sweep. At each frequency from 3 to 15 Hz a diagram leaves
out 200 periods and keeps 100, exponents leave out 100 and keep 200. Times are those of the first
call, with compiling, and of the second one, with the compiler's options of the command.
"""

import argparse
import contextlib
import os
import time
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import impactjax as ij
from impactjax._cli.compiler_flags import FAST

os.environ.setdefault("XLA_FLAGS", FAST)  # read before the first computation
jax.config.update("jax_enable_x64", True)

SWEEP = (-0.0004963, 0.019409, -0.33884, -0.6252)  # of log10 A, by the frequency in Hz
LAWS = {"restitution": ij.Restitution(0.6), "kelvin-voigt": ij.KelvinVoigt(725.0, 0.1605)}


class Swept(ij.AbstractBaseMotion):
    """A base that moves by A sin 2πft, with an amplitude that depends on the frequency."""

    hertz: Array

    def inertia(self, t: Array) -> Array:
        omega = 2 * jnp.pi * self.hertz
        return 10 ** jnp.polyval(jnp.array(SWEEP), self.hertz) * omega**2 * jnp.sin(omega * t)


def hertz(model: ij.ImpactOscillator) -> Array:
    """The frequency of the base [Hz]."""
    assert isinstance(model.oscillator, ij.Pendulum)
    assert isinstance(model.oscillator.base, Swept)
    return model.oscillator.base.hertz


def period(model: ij.ImpactOscillator) -> Array:
    """The period of the base [s]."""
    return 1 / hertz(model)


def main() -> None:
    """Prints a line for each law and call."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--frequencies", type=int, default=2400)
    values = np.linspace(3.0, 15.0, arguments.parse_args().frequencies)
    for name, law in LAWS.items():
        pendulum = ij.Pendulum(13.47, zeta=0.0017, length=0.071, base=Swept(jnp.array(5.0)))
        model = ij.ImpactOscillator(pendulum, ij.Stop(law))
        swept = model, ij.InitialState(0.3), period, hertz, values
        for call in ("first", "second"):
            with timed(f"{name}, diagram, {call} call"):
                diagram = ij.diagram(*swept, keep=100, skip=200)
                jax.block_until_ready(diagram.states)
            with timed(f"{name}, exponents, {call} call"):
                exponents = ij.lyapunov_diagram(*swept, count=200, settle=100)
                jax.block_until_ready(exponents.values)
        failed = int(np.sum(np.asarray(diagram.result != ij.RESULTS.successful)))
        settled, largest = np.asarray(diagram.period) > 0, np.asarray(exponents.values)[:, 0]
        print(
            f"{failed} of {len(values)} lanes failed, {np.mean(~settled):.0%} have no period, "
            f"{np.mean(largest > 0):.0%} a positive exponent, {np.mean(np.isneginf(largest)):.0%} "
            "forget all at rest"
        )


@contextlib.contextmanager
def timed(what: str) -> Iterator[None]:
    """Prints how long something takes."""
    wall, processor = time.perf_counter(), time.process_time()
    yield
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    print(f"{what}: {wall:.1f} s, {processor:.1f} CPU s", flush=True)


if __name__ == "__main__":
    main()
