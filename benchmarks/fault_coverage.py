"""Coverage of 95 % intervals on records with the ordinary faults of a laboratory.

    python benchmarks/fault_coverage.py --law kelvin-voigt [--fault zero --fault mixture]

A pendulum of 1.4 s at 1 kHz hits a stop. The motion is integrated here, by Runge-Kutta steps of
50 us that end at each contact, and not by the package. Each record gets one fault, or in the row
`mixture` a random part of all. It is fitted as the command does, without a sidecar. Columns: share
of identified intervals that hold the truth, their number, how many lie more than four standard
errors off, share of parameters that are identified, and what was fitted besides.
"""

import argparse
import collections
import math
import os
import sys
from collections.abc import Callable
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
}
LEVER = 9.80665 / OMEGA_N**2  # of a point mass on a light rod [m]


class Faults(NamedTuple):
    """Faults of a record."""

    zero: float = 0.0  # [rad]
    gain: float = 1.0
    delay: float = 0.0  # [s]
    drift: float = 0.0  # [rad/s]
    cutoff: float = math.inf  # [Hz]
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
    "filtered noise": lambda rng: Faults(cutoff=rng.uniform(30, 100), filtered_noise=True),
    "steps": lambda _: Faults(step=0.1 * DEGREE),
    "friction": lambda rng: Faults(friction=rng.uniform(0, 4)),
    "scatter": lambda rng: Faults(scatter=rng.uniform(0, 0.01)),
    "late release": lambda rng: Faults(late=rng.uniform(0.05, 0.3)),
    "outliers": lambda _: Faults(outliers=0.01),
    "zero force": lambda _: Faults(zero_force=True),
}


def mixture(rng: np.random.Generator) -> Faults:
    """Each fault with a chance of one in three, but for those that the fit does not know."""
    unknown = ("none", "scatter")
    chosen = [
        make(rng) for name, make in FAULTS.items() if name not in unknown and rng.random() < 1 / 3
    ]
    usual = Faults()
    changed = {
        key: value
        for each in chosen
        for key, value in each._asdict().items()
        if value != getattr(usual, key)
    }
    return usual._replace(**changed)


def motion(law: str, rng: np.random.Generator, faults: Faults) -> np.ndarray:
    """Angles at each step."""
    own, count = TRUTHS[law], round(DURATION / STEP) + 1
    soft = law == "kelvin-voigt"
    omega0, gamma = own.get("omega0", 0.0), own.get("gamma", 0.0)

    def acceleration(q: float, v: float, touches: bool) -> float:
        a = -(OMEGA_N**2) * math.sin(q) - 2 * ZETA * OMEGA_N * v
        a -= faults.friction * math.copysign(1.0, v) if v else 0.0
        return a - omega0 * (omega0 * q + 2 * gamma * v) if touches else a

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
        return -(omega0 * q + 2 * gamma * v) if faults.zero_force else -q

    angles, q, v, touches = np.empty(count), START, 0.0, False
    for i in range(count):
        angles[i] = q
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
            if soft:
                v *= factor if touches else 1.0
                touches = not touches
            else:
                speed = abs(v)
                r = own["r"] if law == "restitution" else own["r0"] - own["alpha"] * speed * LEVER
                q, v = 0.0, r * speed * factor
            new = moved(q, v, rest, touches)
        q, v = new
    return angles


def record(law: str, rng: np.random.Generator, faults: Faults) -> ij.Recording:
    """A recording with faults, rounded to 0.001 deg as in a file."""
    angles = motion(law, rng, faults)
    held = round((faults.late + faults.delay) / STEP)
    angles = np.concatenate([np.full(held, angles[0]), angles])[: len(angles)]
    if math.isfinite(faults.cutoff):
        sections = signal.butter(2, faults.cutoff, fs=1 / STEP, output="sos")
        rest = signal.sosfilt_zi(sections) * angles[0]
        angles = signal.sosfilt(sections, angles, zi=rest)[0]
    shown = angles[::EVERY]
    ts = np.arange(len(shown)) * STEP * EVERY
    noise = rng.standard_normal(len(shown))
    if faults.filtered_noise:
        sections = signal.butter(2, faults.cutoff, fs=1000, output="sos")
        noise = np.asarray(signal.sosfilt(sections, noise))
        noise /= np.std(noise)
    shown = faults.gain * shown + faults.zero + faults.drift * ts + NOISE * noise
    wrong = rng.random(len(shown)) < faults.outliers
    shown = np.where(wrong, shown + rng.choice([-1, 1], len(shown)) * 10 * DEGREE, shown)
    step = faults.step or 1e-3 * DEGREE
    return ij.Recording(ts, np.round(shown / step) * step, ij.Angle())


def row(law: str, fault: str, count: int, starts: int) -> str:
    """One row of the table."""
    truth = {"omega_n": OMEGA_N, "zeta": ZETA, **TRUTHS[law]}
    make = mixture if fault == "mixture" else FAULTS[fault]
    held, identified, far, asked = [], 0, 0, collections.Counter()
    for seed in range(count):
        rng = np.random.default_rng([seed, len(fault), len(law)])
        prepared = ij.prepare(record(law, rng, make(rng)), laws=[law])
        comparison = ij.compare(prepared, starts=ij.Starts(starts))
        best = comparison.best.estimate
        wider = ij.across([fit.estimate for fit in comparison])
        asked.update(set(best.names) - {*truth, "theta0", "theta_dot0", "offset"})
        for name, value in truth.items():
            if best.verdict(name) is ij.Verdict.IDENTIFIED:
                own = best[name]
                whole = wider.get(name, own)
                if whole.verdict is not ij.Verdict.IDENTIFIED:
                    continue
                low, high = whole.low, whole.high
                identified += 1
                held.append(low <= value <= high)
                if abs(value - (low + high) / 2) > 4 / 1.96 * (high - low) / 2:
                    far += 1
                    print(f"{law}, {fault}, seed {seed}: {own}, {low} to {high}", file=sys.stderr)
    besides = ", ".join(f"{name} {times}" for name, times in asked.most_common())
    share = f"{np.mean(held):.3f}" if held else "-"
    all_ = count * len(truth)
    return (
        f"| {law} | {fault} | {share} | {len(held)} | {far} | {identified / all_:.2f} | {besides} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--law", choices=[*TRUTHS], default="kelvin-voigt")
    parser.add_argument("--fault", choices=[*FAULTS, "mixture"], action="append")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--starts", type=int, default=16)
    asked = parser.parse_args()
    print("| law | fault | covered | intervals | far off | identified | fitted besides |")
    print("|---|---|---|---|---|---|---|")
    for fault in asked.fault or [*FAULTS, "mixture"]:
        if fault != "zero force" or asked.law == "kelvin-voigt":
            print(row(asked.law, fault, asked.count, asked.starts), flush=True)


if __name__ == "__main__":
    main()
