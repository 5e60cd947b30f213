"""Times of profiles and ridges, and the coverage of their intervals where a parabola fails.

    python benchmarks/profiles.py [--count 500] [--rows 100]

Times: wall-clock and CPU seconds of the shipped Kelvin-Voigt record, 1401 samples and six
parameters. Coverage: a free mass bounces off a stop of Kelvin and Voigt once, and 40 noisy
positions before and after tell the duration of the contact to about 30 %. The frequency of the
contact goes with the inverse, so that the interval value ± 1.96 errors is too short above and too
long below.
"""

import argparse
import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp

import impactjax as ij
from impactjax._sensor.system import System

jax.config.update("jax_enable_x64", True)

FREQUENCY, NOISE = 300.0, 4.3e-3
T = TypeVar("T")


class Clock(NamedTuple):
    """Wall-clock and CPU time at an instant."""

    wall: float
    cpu: float


def now() -> Clock:
    """The present time."""
    return Clock(time.perf_counter(), time.process_time())


def timed(name: str, work: Callable[[], T]) -> T:
    """The result of some work, with its times printed."""
    begin = now()
    result = work()
    end = now()
    wall, cpu = end.wall - begin.wall, end.cpu - begin.cpu
    print(f"{name:32} {wall:7.2f} s, {cpu:7.2f} CPU s", flush=True)
    return result


def speeds(rows: int) -> None:
    """Prints the times of the shipped record."""
    recording = ij.io.read_recording("data/kelvin_voigt.csv").recording
    pendulum = ij.Pendulum(omega_n=13.0, zeta=0.002, length=0.071)
    model = ij.ImpactOscillator(pendulum, ij.Stop(ij.KelvinVoigt(600.0, 0.2)))
    sensor = ij.Sensor(low_pass=ij.Butterworth(50.0))
    experiment = ij.Experiment(model, recording, ij.InitialState(0.78), sensor=sensor)
    estimate = timed("fit, with compiling", lambda: ij.fit(experiment))
    for turn in ("first", "warm"):
        timed(f"profiles 2 x 41, {turn}", lambda: ij.profiles(estimate, "omega0", "gamma"))
    timed("profiles 6 x 41, warm", lambda: ij.profiles(estimate))
    for turn in ("first", "warm"):
        timed(f"prediction 41, {turn}", lambda: ij.predicted(estimate, slow_restitution))
    size = (rows, rows)
    for turn in ("first", "warm"):
        timed(
            f"ridge {rows} x {rows}, {turn}",
            lambda: ij.ridge(estimate, "omega0", "gamma", points=size),
        )


def slow_restitution(system: System) -> jax.Array:
    """The restitution at 0.2 m/s."""
    stop = system.model.lower
    assert stop is not None
    assert isinstance(stop.law, ij.KelvinVoigt)
    return stop.law.equivalents(jnp.asarray(0.2), system.model.oscillator.mass).restitution


def bounce() -> ij.Experiment:
    """The plan of one bounce."""
    model = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.KelvinVoigt(FREQUENCY, 0.1)))
    instants = jnp.concatenate([jnp.linspace(0.0, 0.19, 20), jnp.linspace(0.24, 0.43, 20)])
    return ij.Experiment(
        model,
        ij.planned(instants, ij.Displacement()),
        ij.InitialState(0.2, -1.0),
        ij.Sensor(sigma=NOISE),
        simulation=ij.Simulation(max_steps=64, max_impacts=4),
        noise=ij.WhiteNoise(),
    )


def coverage(count: int) -> None:
    """Prints the shares of intervals that hold the true frequency of the contact."""
    plan, held = bounce(), {"profile": 0, "walk": 0, "parabola": 0}
    shapes: dict[str, int] = {}
    told = ij.information(plan)
    print(f"bound of omega0: {told.bounds[told.names.index('omega0')] / FREQUENCY:.2f} of it")
    for key in jax.random.split(jax.random.key(0), count):
        estimate = ij.fit(ij.synthetic(plan, key))
        if not bool(estimate.usable):
            shapes["not usable"] = shapes.get("not usable", 0) + 1
            continue
        each = ij.profiles(estimate, "omega0", points=15)["omega0"]
        shapes[str(each.shape)] = shapes.get(str(each.shape), 0) + 1
        ends = {
            "profile": (each.low, each.high),
            "walk": ends_of(ij.profiled(estimate)),
            "parabola": ends_of(estimate),
        }
        for name, (low, high) in ends.items():
            held[name] += low <= FREQUENCY <= high
    print(", ".join(f"{name}: {number / count:.3f}" for name, number in held.items()))
    print(shapes)


def ends_of(estimate: ij.Estimate[ij.Problem]) -> tuple[float, float]:
    """The interval of an estimate."""
    found = estimate["omega0"]
    return found.low, found.high


def main() -> None:
    """Prints times and coverage."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=500)
    arguments.add_argument("--rows", type=int, default=100)
    asked = arguments.parse_args()
    if asked.rows:
        speeds(asked.rows)
    if asked.count:
        timed("coverage", lambda: coverage(asked.count))


if __name__ == "__main__":
    main()
