"""The command `impactjax simulate`."""

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from impactjax._cli.refusal import Refusal, check_names
from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS, with_known
from impactjax._compare.requests import parameters
from impactjax._compare.typical_systems import typical_system
from impactjax._parameter import Range
from impactjax._problem.parameters import replaced
from impactjax._results import RESULTS
from impactjax._sensor.quantity import QUANTITIES
from impactjax._sensor.system import System
from impactjax._simulate.simulate import simulate
from impactjax._simulate.trajectory import Trajectory

_MOST_SAMPLES = 10_000_000


def simulate_command(
    law: Annotated[
        str, typer.Option("--law", metavar="NAME", help=f"{NO_LAW}, {', '.join(LAWS)}.")
    ] = "restitution",
    system: Annotated[
        str, typer.Option("--system", metavar="NAME", help=", ".join(OSCILLATORS) + ".")
    ] = "pendulum",
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A parameter, in SI units or as in theta0=45deg. May be given several times.",
        ),
    ] = None,
    duration: Annotated[float, typer.Option("--duration", metavar="S", help="In seconds.")] = 1.4,
    rate: Annotated[float, typer.Option("--rate", metavar="HZ", help="Samples a second.")] = 1000.0,
    noise: Annotated[
        float, typer.Option("--noise", metavar="X", help="Noise of the samples, in deg or mm.")
    ] = 0.0,
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", min=0, help="Random seed for the noise.")
    ] = 0,
    impacts: Annotated[
        bool, typer.Option("--impacts", help="Write the impact log instead of the samples.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Output file; standard output if omitted."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite FILE.")] = False,
) -> None:
    """Simulate a system and write its motion as a recording that `fit` reads.

    \b
    Examples:
      impactjax simulate --law kelvin-voigt --set omega0=727 --set gamma=0.18 --noise 0.2
      impactjax simulate --system bouncing-ball --set r=0.9 --set x0=200mm --impacts
    """  # noqa: D301  Click takes the backspace as "do not wrap"
    try:
        check_names([law], system)
        _check_sizes(duration, rate, noise)
        if out is not None and out.exists() and not force:
            raise Refusal(f"{out} exists; use --force to overwrite it.")
        built = _system(law, system, settings or [])
        ts = np.arange(round(duration * rate) + 1) / rate
        run = simulate(built.model, built.initial, ts, max_steps=16384, max_impacts=4096)
        if run.result != RESULTS.successful:
            raise Refusal(str(RESULTS[run.result]))
        text = _impact_rows(run) if impacts else _sample_rows(built, run, noise, seed)
        _write(text, out)
    except (Refusal, ValueError) as error:
        typer.echo(f"impactjax: {error}", err=True)
        raise typer.Exit(2) from error


def _check_sizes(duration: float, rate: float, noise: float) -> None:
    if not (duration > 0 and rate > 0 and 1 <= duration * rate <= _MOST_SAMPLES):
        raise Refusal(f"--duration times --rate must be from 1 to {_MOST_SAMPLES:.0e} samples.")
    if not 0 <= noise < np.inf:
        raise Refusal("--noise must be finite and at least 0.")


def _system(law: str, oscillator: str, settings: list[str]) -> System:
    """A system with typical values, except for those that were set."""
    kind = OSCILLATORS[oscillator]()
    known = parameters(kind, [law])
    del known["t0"]  # samples start at zero
    values = dict(_setting(text, known) for text in settings)
    typical = typical_system(with_known(kind, values), law)
    changed = replaced(typical, tuple(values), tuple(values.values())) if values else typical
    for requirement in changed.model.requirements():
        if not bool(requirement.holds):
            raise Refusal(f"{requirement.sentence}.")
    return changed


def _setting(text: str, known: Mapping[str, Range]) -> tuple[str, float]:
    """A name and a value in SI units from NAME=VALUE."""
    match = re.fullmatch(r"(\w+)=([-+.\deE]+)\s*(\D*)", text)
    if match is None:
        raise Refusal(f"`{text}` is not NAME=VALUE with a number.")
    name, number, unit = match.groups()
    if name not in known:
        raise Refusal(f"there is no parameter `{name}`; there are {', '.join(known)}.")
    own = known[name].unit
    units = next((each.units for each in QUANTITIES.values() if each.unit == own), {own: 1.0})
    if unit and unit not in units:
        raise Refusal(f"unknown unit `{unit}` in `{text}`; use {' or '.join(units)}.")
    try:
        return name, float(number) * units.get(unit, 1.0)
    except ValueError as error:
        raise Refusal(f"`{number}` in `{text}` is not a number.") from error


def _write(text: str, out: Path | None) -> None:
    if out is None:
        sys.stdout.write(text)
        return
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise Refusal(f"{out} cannot be written ({error.strerror}); choose another.") from error


def _sample_rows(system: System, run: Trajectory, noise: float, seed: int) -> str:
    angle = system.model.oscillator.is_angle()
    factor, column = (180 / np.pi, "angle [deg]") if angle else (1e3, "displacement [mm]")
    values = np.asarray(run.position) * factor
    values = values + noise * np.random.default_rng(seed).standard_normal(len(values))
    rows = [f"{t:.9g}, {x:.9g}" for t, x in zip(np.asarray(run.ts), values, strict=True)]
    return "\n".join([f"time [s], {column}", *rows]) + "\n"


def _impact_rows(run: Trajectory) -> str:
    log = run.impacts
    columns = {
        "impact time [s]": log.time,
        "approach speed [m/s]": log.approach_speed,
        "separation speed [m/s]": log.separation_speed,
        "restitution [1]": log.restitution,
        "duration [s]": log.duration,
        "energy lost [J]": log.energy_lost,
    }
    values = np.stack([np.asarray(column) for column in columns.values()], axis=1)
    rows = [", ".join(f"{x:.9g}" for x in row) for row in values[: int(log.count)]]
    return "\n".join([", ".join(columns), *rows]) + "\n"
