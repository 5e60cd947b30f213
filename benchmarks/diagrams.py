"""Bifurcation diagrams of the forced pendulum, with the amplitudes of the thesis's sweep.

    python benchmarks/diagrams.py [--frequencies 2400]

At each frequency from 3 to 15 Hz 200 periods are left out and 100 kept. Times are those of the
first call, with compiling, and of the second one, with the compiler's options of the command.
"""

import argparse
import os
import time

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
    """Prints a line for each law."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--frequencies", type=int, default=2400)
    values = np.linspace(3.0, 15.0, arguments.parse_args().frequencies)
    for name, law in LAWS.items():
        pendulum = ij.Pendulum(13.47, zeta=0.0017, length=0.071, base=Swept(jnp.array(5.0)))
        model = ij.ImpactOscillator(pendulum, ij.Stop(law))
        for call in ("first", "second"):
            wall, processor = time.perf_counter(), time.process_time()
            found = ij.diagram(
                model, ij.InitialState(0.3), period, hertz, values, keep=100, skip=200
            )
            jax.block_until_ready(found.states)
            wall, processor = time.perf_counter() - wall, time.process_time() - processor
            good = int(np.sum(np.asarray(found.result == ij.RESULTS.successful)))
            print(
                f"{name}, {call} call: {wall:.1f} s, {processor:.1f} CPU s; "
                f"{good} of {len(values)} lanes, {np.mean(np.asarray(found.period) == 0):.0%} "
                "without a period",
                flush=True,
            )


if __name__ == "__main__":
    main()
