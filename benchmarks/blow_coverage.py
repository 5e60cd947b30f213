"""Coverage of 95 % intervals from records of a single blow, such as that of a hammer.

    python benchmarks/blow_coverage.py [--count 100] [--law kelvin-voigt]

A free mass flies to a stop and leaves it. Its contact force is integrated here, by SciPy, not by
the package. Half of the load cells ring (2 to 8 kHz, damping 0.01 to 0.1), half filter (order 2,
cutoff 2 to 10 kHz), below 0.3 of the sampling rate. Each record has an unknown zero, noise of 0.1
to 1 % of the maximum, and 30 to 150 samples in the contact. It is fitted as the command does, with
the mass stated and no other sidecar. Columns: share of identified intervals that hold the truth,
their number, how many lie more than four standard errors off, and the share of parameters that are
identified.
"""

import argparse
import math
import os
from collections.abc import Iterator
from typing import NamedTuple

import jax
import numpy as np
from scipy import integrate

import impactjax as ij
from impactjax._cli.compiler_flags import FAST

os.environ.setdefault("XLA_FLAGS", FAST)  # read before the first computation
jax.config.update("jax_enable_x64", True)

LAWS = ("kelvin-voigt", "hunt-crossley")


class Blow(NamedTuple):
    """A blow: its law's parameters, mass [kg], speed [m/s] and duration [s]."""

    truths: dict[str, float]
    mass: float
    speed: float
    duration: float

    def force(self, place: float, rate: float) -> float:
        """Force of the stop [N]; it does not pull."""
        if place >= 0:
            return 0.0
        own = self.truths
        if "omega0" in own:
            pushed = -own["omega0"] * (own["omega0"] * place + 2 * own["gamma"] * rate)
            return max(self.mass * pushed, 0.0)
        return max(own["k"] * (-place) ** 1.5 * (1 - own["c"] * rate), 0.0)


def drawn(law: str, rng: np.random.Generator) -> Blow:
    """A random blow."""
    mass, speed = math.exp(rng.uniform(-2, 1)), math.exp(rng.uniform(-1.5, 1))
    duration = rng.uniform(0.5e-3, 4e-3)
    if law == "kelvin-voigt":
        truths = {"omega0": math.pi / duration, "gamma": rng.uniform(0.02, 0.35)}
    else:
        deepest = speed * duration / 2.94  # of a Hertzian contact
        truths = {"k": 1.25 * mass * speed**2 / deepest**2.5, "c": rng.uniform(0.05, 0.6) / speed}
    return Blow(truths, mass, speed, duration)


class Cell(NamedTuple):
    """A load cell of second order: angular frequency [rad/s] and damping ratio."""

    omega: float
    damping: float


def shown(blow: Blow, cell: Cell, ts: np.ndarray) -> np.ndarray:
    """Force that a load cell shows at some times after the touch."""
    omega, damping = cell

    def rates(_: float, y: np.ndarray) -> list[float]:
        force = blow.force(y[0], y[1])
        ringing = omega**2 * (force - y[2]) - 2 * damping * omega * y[3]
        return [y[1], force / blow.mass, y[3], ringing]

    found = integrate.solve_ivp(
        rates,
        (0.0, ts[-1]),
        [0.0, -blow.speed, 0.0, 0.0],
        method="DOP853",
        max_step=blow.duration / 400,
        rtol=1e-10,
        atol=1e-14,
        t_eval=ts,
    )
    return found.y[2]


def cell_of(interval: float, rng: np.random.Generator) -> Cell:
    """A random load cell for a sampling interval."""
    fastest = 0.3 / interval
    if rng.random() < 0.5:
        return Cell(2 * math.pi * min(rng.uniform(2e3, 8e3), fastest), rng.uniform(0.01, 0.1))
    return Cell(2 * math.pi * min(rng.uniform(2e3, 10e3), fastest), math.sqrt(0.5))


def record(blow: Blow, rng: np.random.Generator) -> ij.Recording:
    """A recording of a blow."""
    interval = blow.duration / rng.uniform(30, 150)
    count = round(14 * blow.duration / interval)
    ts = np.arange(count) * interval
    touch = ts[-1] * rng.uniform(0.1, 0.3)
    values = np.zeros(count)
    values[ts >= touch] = shown(blow, cell_of(interval, rng), ts[ts >= touch] - touch)
    largest = values.max()
    noise = largest * math.exp(rng.uniform(math.log(1e-3), math.log(1e-2)))
    values += noise * rng.standard_normal(count) + 0.02 * largest * rng.uniform(-1, 1)
    return ij.Recording(ts, values, ij.ContactForce())


def intervals(law: str, seed: int) -> Iterator[tuple[float, float, float]]:
    """True value and interval of each identified parameter of a record."""
    rng = np.random.default_rng([seed, len(law)])
    blow = drawn(law, rng)
    prepared = ij.prepare(record(blow, rng), laws=[law], fixed={"mass": blow.mass})
    comparison = ij.compare(prepared)
    best, wider = comparison.best.estimate, ij.across([each.estimate for each in comparison])
    for name, truth in {**blow.truths, "x_dot0": -blow.speed}.items():
        own = wider.get(name, best[name])
        if {best.verdict(name), own.verdict} == {ij.Verdict.IDENTIFIED}:
            yield truth, float(own.low), float(own.high)


def main() -> None:
    """Prints a row for each law."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--law", choices=LAWS, action="append")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--verbose", action="store_true", help="print each interval that is off")
    asked = parser.parse_args()
    print("| law | records | covered | intervals | far off | identified |")
    print("|---|---|---|---|---|---|")
    for law in asked.law or LAWS:
        held, far = [], 0
        for seed in range(asked.first, asked.first + asked.count):
            for truth, low, high in intervals(law, seed):
                held.append(low <= truth <= high)
                far += (off := abs(truth - (low + high) / 2) / ((high - low) / 2)) > 4 / 1.96
                if asked.verbose and off > 1:
                    print(f"seed {seed}: {truth:.6g} not in {low:.6g} to {high:.6g}")
        share, possible = np.mean(held) if held else math.nan, 3 * asked.count
        print(
            f"| {law} | {asked.count} | {share:.3f} | {len(held)} | {far} "
            f"| {len(held) / possible:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
