"""Coverage of 95 % intervals on records with the ordinary faults of a laboratory.

    python benchmarks/fault_coverage.py --law kelvin-voigt [--fault zero --fault mixture]
    python benchmarks/fault_coverage.py --observed angular-velocity
    python benchmarks/fault_coverage.py --table RECORDS...

A pendulum of 1.4 s at 1 kHz hits a stop. The motion is integrated here, by Runge-Kutta steps of
50 us that end at each contact, and not by the package. Each record gets one fault, or in the row
`mixture` a random part of all. It is fitted as the command does, without a sidecar, except that
`wrong low-pass` states a cutoff of 50 Hz. The angle is recorded, or with `--observed` a derivative
of it, whose zero, drift, noise, steps and outliers are larger by a factor of 13.47 or 13.47².
Columns: share of identified intervals that hold the truth, their number, how many lie more than
four standard errors off, share of parameters that are identified, and what was fitted besides.

With `--records FILE` each fitted record is appended to a file, as a line of JSON, from which
`--table` makes the table. So several processes can share a row: give each another `--first`.
"""

import argparse
import collections
import json
import math
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np
from scipy import signal

import impactjax as ij
from impactjax._cli.compiler_flags import FAST

os.environ.setdefault("XLA_FLAGS", FAST)  # read before the first computation
jax.config.update("jax_enable_x64", True)

STEP, EVERY, DURATION = 50e-6, 20, 1.4  # integration step [s], steps a sample, and length [s]
NOISE, DEGREE = math.radians(0.2), math.pi / 180
OMEGA_N, ZETA, START = 13.47, 0.0017, math.pi / 4
TRUTHS = {
    "restitution": {"r": 0.6},
    "linear-restitution": {"r0": 0.7, "alpha": 0.05},
    "kelvin-voigt": {"omega0": 600.0, "gamma": 0.15},
    "walton": {"k": 360e3, "c": 360e3},
    "hunt-crossley": {"k": 10e6, "c": 1.0},
}
LEVER = 9.80665 / OMEGA_N**2  # of a point mass of 1 kg on a light rod [m]
STATED = 50.0  # stated cutoff [Hz], where one is stated
OBSERVED: list[ij.AbstractQuantity] = [ij.Angle(), ij.AngularVelocity(), ij.AngularAcceleration()]
NAMES = [each.name.replace(" ", "-") for each in OBSERVED]


class Faults(NamedTuple):
    """Faults of a record."""

    zero: float = 0.0  # [rad], as the other faults of an angle
    gain: float = 1.0
    delay: float = 0.0  # [s]
    drift: float = 0.0  # [rad/s]
    cutoff: float = math.inf  # [Hz]
    states_cutoff: bool = False
    filtered_noise: bool = False
    step: float = 0.0  # [rad]
    friction: float = 0.0  # [rad/s²]
    scatter: float = 0.0
    late: float = 0.0  # [s], for which a hand holds
    outliers: float = 0.0  # share of the samples
    zero_force: bool = False  # the stop does not pull


FAULTS: dict[str, Callable[[np.random.Generator], Faults]] = {
    "none": lambda _: Faults(),
    "zero": lambda rng: Faults(zero=rng.uniform(-0.6, 0.6) * DEGREE),
    "gain": lambda rng: Faults(gain=1 + rng.uniform(-0.03, 0.03)),
    "delay": lambda rng: Faults(delay=rng.uniform(0, 5e-3)),
    "drift": lambda rng: Faults(drift=rng.uniform(-0.5, 0.5) * DEGREE),
    "low-pass": lambda rng: Faults(cutoff=rng.uniform(30, 100)),
    "wrong low-pass": lambda rng: Faults(cutoff=rng.uniform(35, 70), states_cutoff=True),
    "filtered noise": lambda rng: Faults(cutoff=rng.uniform(30, 100), filtered_noise=True),
    "steps": lambda _: Faults(step=0.1 * DEGREE),
    "friction": lambda rng: Faults(friction=rng.uniform(0, 4)),
    "scatter": lambda rng: Faults(scatter=rng.uniform(0, 0.01)),
    "late release": lambda rng: Faults(late=rng.uniform(0.05, 0.3)),
    "outliers": lambda _: Faults(outliers=0.01),
    "zero force": lambda _: Faults(zero_force=True),
}


def mixture(rng: np.random.Generator) -> Faults:
    """Each fault with a chance of one in three."""
    chosen = [make(rng) for make in FAULTS.values() if rng.random() < 1 / 3]
    usual = Faults()
    changed = {
        key: value
        for each in chosen
        for key, value in each._asdict().items()
        if value != getattr(usual, key)
    }
    return usual._replace(**changed)


def contact(law: str) -> Callable[[float, float], float] | None:
    """Angular acceleration by a compliant stop, by angle and rate; `None` for a rigid one."""
    own = TRUTHS[law]
    if law == "kelvin-voigt":
        omega0, gamma = own["omega0"], own["gamma"]
        return lambda q, v: -omega0 * (omega0 * q + 2 * gamma * v)
    if law == "walton":
        return lambda q, v: own["k"] * -q * (1 - own["c"] / own["k"] * LEVER * v)
    if law == "hunt-crossley":
        return lambda q, v: (
            own["k"] * max(-q * LEVER, 0.0) ** 1.5 * (1 - own["c"] * LEVER * v) / LEVER
        )
    return None


def motion(law: str, rng: np.random.Generator, faults: Faults) -> np.ndarray:
    """Angle, angular velocity and angular acceleration at each step."""
    own, count, force = TRUTHS[law], round(DURATION / STEP) + 1, contact(law)

    def acceleration(q: float, v: float, touches: bool) -> float:
        a = -(OMEGA_N**2) * math.sin(q) - 2 * ZETA * OMEGA_N * v
        a -= faults.friction * math.copysign(1.0, v) if v else 0.0
        return a + force(q, v) if touches and force else a

    def moved(q: float, v: float, h: float, touches: bool) -> tuple[float, float]:
        k1 = acceleration(q, v, touches)
        q2, v2 = q + h / 2 * v, v + h / 2 * k1
        k2 = acceleration(q2, v2, touches)
        q3, v3 = q + h / 2 * v2, v + h / 2 * k2
        k3 = acceleration(q3, v3, touches)
        q4, v4 = q + h * v3, v + h * k3
        k4 = acceleration(q4, v4, touches)
        return q + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def left(q: float, v: float, touches: bool) -> float:
        """Positive until the mode ends: in flight the distance, in contact penetration or force."""
        if not touches:
            return q
        return force(q, v) if faults.zero_force and force else -q

    states, q, v, touches = np.empty((3, count)), START, 0.0, False
    for i in range(count):
        states[:, i] = q, v, acceleration(q, v, touches)
        rest = STEP
        new = moved(q, v, rest, touches)
        while left(*new, touches) <= 0 and (v < 0 or touches) and rest > 1e-12:
            low, high = 0.0, rest
            for _ in range(40):
                middle = (low + high) / 2
                inside = left(*moved(q, v, middle, touches), touches) > 0
                low, high = (middle, high) if inside else (low, middle)
            q, v = moved(q, v, high, touches)
            rest -= high
            factor = math.exp(faults.scatter * rng.standard_normal())
            if force:
                v *= factor if touches else 1.0
                touches = not touches
            else:
                speed = abs(v)
                r = own["r"] if law == "restitution" else own["r0"] - own["alpha"] * speed * LEVER
                q, v = 0.0, r * speed * factor
            new = moved(q, v, rest, touches)
        q, v = new
    return states


def measured(states: np.ndarray, order: int, cutoff: float) -> np.ndarray:
    """The angle or a derivative of it behind a low-pass. An acceleration is then the derivative of
    the filtered velocity, which holds the impulse of a rigid stop.
    """
    if not math.isfinite(cutoff):
        return states[order]
    sections = signal.butter(2, cutoff, fs=1 / STEP, output="sos")
    whole = states[min(order, 1)]
    filtered = signal.sosfilt(sections, whole, zi=signal.sosfilt_zi(sections) * whole[0])[0]
    return np.gradient(filtered, STEP) if order == 2 else filtered


def record(law: str, rng: np.random.Generator, faults: Faults, order: int) -> ij.Recording:
    """A recording with faults, of the angle rounded to 0.001 deg as in a file."""
    states = motion(law, rng, faults)
    held = round((faults.late + faults.delay) / STEP)
    before = np.array([START, 0.0, 0.0])
    states = np.hstack([np.tile(before[:, None], held), states])[:, : states.shape[1]]
    shown, unit = measured(states, order, faults.cutoff)[::EVERY], OMEGA_N**order
    ts = np.arange(len(shown)) * STEP * EVERY
    noise = rng.standard_normal(len(shown))
    if faults.filtered_noise:
        sections = signal.butter(2, faults.cutoff, fs=1000, output="sos")
        noise = np.asarray(signal.sosfilt(sections, noise))
        noise /= np.std(noise)
    error = faults.zero + faults.drift * ts + NOISE * noise
    shown = faults.gain * shown + unit * error
    wrong = rng.random(len(shown)) < faults.outliers
    shown = np.where(wrong, shown + rng.choice([-1, 1], len(shown)) * 10 * DEGREE * unit, shown)
    step = (faults.step or 1e-3 * DEGREE) * unit
    return ij.Recording(ts, np.round(shown / step) * step, OBSERVED[order])


class Result(NamedTuple):
    """Result of one record.

    - `truths`: true values by parameter.
    - `intervals`: ends of the intervals of the parameters that are identified.
    - `besides`: names of other parameters that were fitted.
    """

    law: str
    fault: str
    seed: int
    faults: dict[str, float]
    truths: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    besides: list[str]
    observed: str = "angle"


def result(law: str, fault: str, seed: int, starts: int, observed: str) -> Result:
    """Result of the record with a seed."""
    truths = {"omega_n": OMEGA_N, "zeta": ZETA, **TRUTHS[law]}
    rng = np.random.default_rng([seed, len(fault), len(law)])
    faults = mixture(rng) if fault == "mixture" else FAULTS[fault](rng)
    sensor = ij.Sensor(low_pass=ij.Butterworth(STATED)) if faults.states_cutoff else None
    free = ("offset", "drift", "gain") if faults.states_cutoff else ()  # as if only it was stated
    recording = record(law, rng, faults, NAMES.index(observed))
    prepared = ij.prepare(recording, laws=[law], sensor=sensor, free=free)
    comparison = ij.compare(prepared, starts=ij.Starts(starts))
    best = comparison.best.estimate
    wider = ij.across([fit.estimate for fit in comparison])
    intervals = {}
    for name in truths:
        own = wider.get(name, best[name])
        if {best.verdict(name), own.verdict} == {ij.Verdict.IDENTIFIED}:
            intervals[name] = (float(own.low), float(own.high))
    besides = [x for x in best.names if x not in {*truths, "theta0", "theta_dot0", "offset"}]
    usual = Faults()
    changed = {x: float(y) for x, y in faults._asdict().items() if y != getattr(usual, x)}
    return Result(law, fault, seed, changed, truths, intervals, besides, observed)


def rows(results: Iterable[Result]) -> list[str]:
    """The table, a row for each law, quantity and fault."""
    groups = collections.defaultdict[tuple[str, str, str], list[Result]](list)
    for each in results:
        groups[each.law, each.observed, each.fault].append(each)
    heads = ["law", "observed", "fault", "records", "covered", "intervals", "far off"]
    heads += ["identified", "fitted besides"]
    table = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for (law, observed, fault), own in groups.items():
        held, far, asked = [], 0, collections.Counter(x for each in own for x in each.besides)
        for each in own:
            for name, (low, high) in each.intervals.items():
                truth = each.truths[name]
                held.append(low <= truth <= high)
                far += abs(truth - (low + high) / 2) > 4 / 1.96 * (high - low) / 2
        possible = sum(len(each.truths) for each in own)
        share = f"{np.mean(held):.3f}" if held else "-"
        besides = ", ".join(f"{name} {times}" for name, times in asked.most_common())
        numbers = f"{len(own)} | {share} | {len(held)} | {far} | {len(held) / possible:.2f}"
        table.append(f"| {law} | {observed} | {fault} | {numbers} | {besides} |")
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--law", choices=[*TRUTHS], default="kelvin-voigt")
    parser.add_argument("--observed", choices=NAMES, default=NAMES[0])
    parser.add_argument("--fault", choices=[*FAULTS, "mixture"], action="append")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--starts", type=int, default=16)
    parser.add_argument("--records", type=Path, help="file to which results are appended")
    parser.add_argument("--table", type=Path, nargs="+", help="files of results to tabulate")
    asked = parser.parse_args()
    results = []
    if asked.table:
        lines = [line for path in asked.table for line in path.read_text().splitlines()]
        results = [Result(**json.loads(line)) for line in lines]
    else:
        for fault in asked.fault or [*FAULTS, "mixture"]:
            for seed in range(asked.first, asked.first + asked.count):
                results.append(result(asked.law, fault, seed, asked.starts, asked.observed))
                if asked.records:
                    with asked.records.open("a") as file:
                        print(json.dumps(results[-1]._asdict()), file=file)
    print(*rows(results), sep="\n")


if __name__ == "__main__":
    main()
