"""Recovery of contact parameters from records of a pendulum on a shaken base, the phase unknown.

    python benchmarks/forced_fits.py [--seeds 20] [--only "8 Hz"]

Records of 10 s at 1 kHz with noise of 0.2 deg, after 40 s of settling, integrated by SciPy apart
from the package: steady motions at 4.2 and 8 Hz and sweeps of the frequency, fitted whole, and a
chaotic one at 10 Hz, fitted in segments. A sweep begins with the record, after settling at its
first frequency. Each is fitted from the first look of `prepare`. Columns: in how many records the
95 % interval of each parameter holds the truth, the largest deviation in standard errors, and
seconds a record after the first one.
"""

import argparse
import math
import os
import time
from typing import NamedTuple

import jax
import numpy as np
from scipy.integrate import solve_ivp

import impactjax as ij
from impactjax._cli.compiler_flags import FAST

os.environ.setdefault("XLA_FLAGS", FAST)  # read before the first computation
jax.config.update("jax_enable_x64", True)

OMEGA_N, ZETA, LENGTH, R = 13.47, 0.0017, 0.071, 0.6
SETTLE, DURATION, RATE, NOISE = 40.0, 10.0, 1000, math.radians(0.2)
TOLERANCE = 1e-11
STATED = {"length": LENGTH, "gain": 1.0, "offset": 0.0, "drift": 0.0}


class Case(NamedTuple):
    """A motion of the base, up to another frequency in a sweep, and a law; segments of the fit, if
    there are any.
    """

    name: str
    hertz: float
    amplitude: float
    law: str
    truths: dict[str, float]
    segments: int | None = None
    until: float | None = None

    @property
    def base(self) -> ij.AbstractBaseMotion:
        """The motion of the base, with the phase 0."""
        begin = 2 * np.pi * self.hertz
        if self.until is None:
            return ij.HarmonicMotion(self.amplitude, begin)
        return ij.Chirp(self.amplitude, begin, (2 * np.pi * self.until - begin) / DURATION)


CASES = (
    Case("4.2 Hz", 4.2, 4.6e-3, "kelvin-voigt", {"omega0": 723.0, "gamma": 0.14}),
    Case("4.2 Hz", 4.2, 4.6e-3, "restitution", {"r": R}),
    Case("8 Hz", 8.0, 5.2e-3, "kelvin-voigt", {"omega0": 725.0, "gamma": 0.165}),
    Case("8 Hz", 8.0, 5.2e-3, "restitution", {"r": R}),
    Case("4 to 6 Hz", 4.0, 4.6e-3, "kelvin-voigt", {"omega0": 723.0, "gamma": 0.14}, until=6.0),
    Case("4 to 6 Hz", 4.0, 4.6e-3, "restitution", {"r": R}, until=6.0),
    Case("4 to 9 Hz", 4.0, 5.2e-3, "kelvin-voigt", {"omega0": 725.0, "gamma": 0.165}, until=9.0),
    Case("7 to 9 Hz", 7.0, 5.2e-3, "restitution", {"r": R}, until=9.0),
    Case("10 Hz", 10.0, 3.1e-3, "kelvin-voigt", {"omega0": 725.0, "gamma": 0.136}, 28),
)


def angles(case: Case, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and angles of a record without noise."""
    rate, truths = 2 * np.pi * case.hertz, case.truths
    change = 0.0 if case.until is None else (2 * np.pi * case.until - rate) / DURATION
    compliant = "omega0" in truths

    def inertia(t: float) -> float:
        faster = change if t > 0 else 0.0
        now, angle = rate + faster * t, (rate + faster * t / 2) * t + phase
        return case.amplitude * (now**2 * math.sin(angle) - faster * math.cos(angle))

    def free(t: float, y: np.ndarray) -> list[float]:
        push = inertia(t) / LENGTH * math.cos(y[0])
        return [y[1], push - 2 * ZETA * OMEGA_N * y[1] - OMEGA_N**2 * math.sin(y[0])]

    def touching(t: float, y: np.ndarray) -> list[float]:
        own, gamma = truths["omega0"], truths["gamma"]
        return [y[1], free(t, y)[1] - own**2 * y[0] - 2 * gamma * own * y[1]]

    ts = np.arange(round(DURATION * RATE) + 1) / RATE
    found, t, y, inside = np.zeros_like(ts), -SETTLE, np.array([0.3, 0.0]), False
    while t < DURATION:
        run = solve_ivp(
            touching if inside else free,
            (t, 0.0 if t < 0 else DURATION),  # the force jumps where a sweep begins
            y,
            "DOP853",
            rtol=TOLERANCE,
            atol=TOLERANCE / 10,
            dense_output=True,
            events=_crossing(1 if inside else -1),
        )
        within = (ts >= t) & (ts <= run.t[-1])
        if within.any():
            found[within] = run.sol(ts[within])[0]
        t, y = float(run.t[-1]), run.y[:, -1]
        if run.status != 1:
            continue
        y[0] = 0.0
        if compliant:
            inside = not inside
        else:
            y[1] *= -truths["r"]
    return ts, found


def _crossing(direction: int):
    def place(t: float, y: np.ndarray) -> float:
        return y[0]

    vars(place).update(terminal=True, direction=direction)
    return place


def deviations(case: Case, seed: int) -> tuple[dict[str, tuple[bool, float]], float]:
    """Coverage of each truth by its interval, with its deviation in errors; seconds of the fit."""
    random = np.random.default_rng(seed)
    phase = random.uniform(-np.pi, np.pi)
    ts, values = angles(case, phase)
    record = ij.Recording(ts, values + NOISE * random.standard_normal(len(ts)), ij.Angle())
    pendulum = ij.Pendulum(10.0, 0.01, length=LENGTH, base=case.base)
    sensor = ij.Sensor()  # states that nothing is filtered
    prepared = ij.prepare(
        record, oscillator=pendulum, laws=[case.law], sensor=sensor, fixed=STATED, free=["phase"]
    )
    experiment = prepared.experiments[case.law]
    begin = time.perf_counter()
    if case.segments is None:
        estimate = ij.fit(experiment, starts=ij.Starts(8 if case.until is None else 16))
    else:
        estimate = ij.fit_in_segments(experiment, case.segments)
    seconds = time.perf_counter() - begin
    found = {}
    for name, truth in ({"omega_n": OMEGA_N, "zeta": ZETA, "phase": phase} | case.truths).items():
        own = estimate[name]
        away = float((own.value - truth) / own.standard_error)
        found[name] = bool(own.low <= truth <= own.high), away
    return found, seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", help="name of a case")
    asked = parser.parse_args()
    print("| case | law | held | largest deviation | seconds |\n|---|---|---|---|---|")
    for case in CASES:
        if asked.only in (None, case.name):
            each = [deviations(case, seed) for seed in range(asked.seeds)]
            names = each[0][0]
            held = [f"{x} {sum(found[x][0] for found, _ in each)}" for x in names]
            most = max(abs(found[x][1]) for found, _ in each for x in names)
            usual = np.median([seconds for _, seconds in each[1:] or each])
            print(
                f"| {case.name} | {case.law} | {', '.join(held)} of {len(each)} | {most:.2f} "
                f"| {usual:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
