"""The command `impactjax identifiability`."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from impactjax._cli.fitting import compared, prepared_for
from impactjax._cli.options import SidecarFile, SystemName, options, surveyed
from impactjax._cli.refusal import Refusal, check_names, refusals_told
from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._design.from_file import planned_experiments
from impactjax._fit.estimate import Estimate
from impactjax._identify.experiment_information import information
from impactjax._identify.identifiability import identifiability
from impactjax._identify.information import Information
from impactjax._identify.structure import Told, structure
from impactjax._identify.words import coupling
from impactjax._number_format import with_error, with_unit
from impactjax._problem.problem import Problem
from impactjax._record.plan_file import read_plan
from impactjax._report.profile_curves import NO_CURVES, curves_of
from impactjax._terminal import telling

_PLAN = ".toml"
_LAW_HELP = f"A law to fit to a recording: {NO_LAW}, {', '.join(LAWS)}. May be given several times."


def identifiability_command(
    path: Annotated[
        Path, typer.Argument(metavar="RECORDING|PLAN.toml", help="A recording, or a plan of one.")
    ],
    laws: Annotated[list[str] | None, typer.Option("--law", metavar="NAME", help=_LAW_HELP)] = None,
    system: SystemName = None,
    sidecar: SidecarFile = None,
) -> None:
    """Say which parameters, and which combinations of them, a recording tells: one that exists,
    after a fit, or one that is only planned.

    \b
    Examples:
      impactjax identifiability swing.csv --law walton
      impactjax identifiability plan.toml
    """  # noqa: D301  Click takes the backspace as "do not wrap"
    with refusals_told():
        if path.suffix == _PLAN:
            if laws or system or sidecar:
                raise Refusal("a plan names its own law; omit --law, --system and --sidecar.")
            text = _of_plan(path)
        else:
            text = _of_recording(path, laws, system, sidecar)
    typer.echo(text)


def _of_plan(path: Path) -> str:
    read = read_plan(path)
    made = planned_experiments(path, read)
    try:
        with telling(path.name) as tell:
            tell("information")
            told = information(made.experiments, scatter=read.system.scatter)
            never = list[str]()
            if len(made.experiments) == 1:
                tell("structure at random points")
                found = structure(made.experiments[0])
                never = [name for name in found.names if found[name] == Told.NEVER]
    except ValueError as error:
        raise Refusal(f"{path}: {error}") from error
    never_told = [f"No recording of this kind tells {', '.join(never)}."] if never else []
    return "\n".join([read.system.law, *_rows(told), coupling(told), *never_told])


def _of_recording(
    path: Path, laws: list[str] | None, system: str | None, sidecar: Path | None
) -> str:
    check_names(laws or [], system)
    oscillator, said = None if system is None else OSCILLATORS[system](), options([], [])
    made = prepared_for(surveyed(path, sidecar, oscillator, laws, said), said)
    blocks = []
    for fitted in compared([made], 0)[0].fits:
        estimate = fitted.estimate
        if not bool(estimate.usable):
            blocks.append(f"{fitted.name}\n  No fit that could be used: {estimate.cause}.")
            continue
        told = identifiability(estimate)
        lines = [fitted.name, *_rows(told), coupling(told), *profile_rows(estimate)]
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks)


def profile_rows(estimate: Estimate[Problem]) -> list[str]:
    """The interval and the shape of each profile."""
    if estimate.scatter is not None:
        return [NO_CURVES]
    return ["Profiles, 95 %:", *(f"  {each}" for each in curves_of(estimate).values())]


def _rows(told: Information) -> list[str]:
    """A row for each parameter: its value, and the standard error that it has at least."""
    values, bounds = np.asarray(told.values), np.asarray(told.bounds)
    width, rows = max(len(name) for name in told.names), []
    for name, unit, value, bound in zip(told.names, told.units, values, bounds, strict=True):
        finite = bool(np.isfinite(bound))
        shown = with_error(value, bound) if finite else f"{value:.4g}, not determined"
        rows.append(f"  {name:{width}}  {with_unit(shown, unit) if finite else shown}")
    return rows
