"""The command `impactjax design`."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from impactjax._cli.files import in_folder, write
from impactjax._cli.options import Force
from impactjax._cli.refusal import Refusal, refusals_told
from impactjax._design.design import design
from impactjax._design.from_file import criterion_of, planned_experiments
from impactjax._design.plan import Design
from impactjax._record.plan_file import read_plan
from impactjax._report.design_report import design_texts
from impactjax._report.write import design_files
from impactjax._terminal import telling

_REFITS_HELP = "Simulated refits that verify the expected intervals; 0 for none."


def design_command(
    plan: Annotated[Path, typer.Argument(metavar="PLAN.toml", help="The plan of experiments.")],
    refits: Annotated[
        int, typer.Option("--refits", metavar="N", min=0, max=10_000, help=_REFITS_HELP)
    ] = 100,
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", min=0, max=2**32 - 1, help="Random seed.")
    ] = 0,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to write design.json and design.html."),
    ] = None,
    force: Force = False,
) -> None:
    """Find the experiments to perform next: the cheapest that tell a parameter as well as asked, or
    the best within a budget.

    The plan names the system, its values, the sensor with its noise, the choices, and a goal or a
    criterion with a budget.

    \b
    [system]
    law = "kelvin-voigt"
    [values]
    omega0 = 600.0
    [sensor]
    sigma = 0.0035
    cutoff = 50.0
    [choices]
    theta0 = { low = 0.2, high = 1.2 }
    duration = [0.7, 1.4]
    [goal]
    omega0 = 0.05
    """  # noqa: D301  Click takes the backspace as "do not wrap"
    with refusals_told():
        targets = () if out is None else design_files(out)
        if out is not None:
            in_folder(out, targets, force)
        found = _found(plan, refits, seed)
        typer.echo(str(found))
        if targets:
            command = shlex.join(["impactjax", *sys.argv[1:]])
            write(targets, design_texts(found, plan.name, command), force)
    if not found.reached:
        raise typer.Exit(1)


def _found(path: Path, refits: int, seed: int) -> Design:
    plan = read_plan(path)
    criterion, made = criterion_of(path, plan), planned_experiments(path, plan)
    try:
        with telling(path.name) as tell:
            return design(
                made.candidates,
                made.system.model,
                criterion,
                budget=plan.budget,
                scatter=plan.system.scatter,
                refits=refits,
                seed=seed,
                tell=tell,
            )
    except ValueError as error:
        raise Refusal(f"{path}: {error}") from error
