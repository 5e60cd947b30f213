"""The command `impactjax fit`."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from impactjax._check.check import checked
from impactjax._cli.files import in_folder, write
from impactjax._cli.fitting import compared, prepared_for
from impactjax._cli.options import (
    Fix,
    Force,
    Free,
    LossName,
    Prior,
    Recordings,
    SidecarFile,
    SystemName,
    files_of,
    held_out,
    options,
    surveyed,
)
from impactjax._cli.refusal import Refusal, check_names, refusals_told
from impactjax._cli.tables import print_fits, print_repeats
from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.repeatability import repeatability
from impactjax._report.write import report_files, report_texts

_SEED_HELP = "Random seed for scattered starts."
_HOLDOUT_HELP = (
    "What is not fitted but predicted by each law: a share of the record, at its end, or another "
    "recording of the same rig."
)
_TOGETHER_HELP = "The recordings are repeats of one experiment: means, and scatter between them."
_LAW_HELP = f"A law to fit: {NO_LAW} (free flight), {', '.join(LAWS)}. May be given several times."

_PROFILES_HELP = "Add profile likelihoods of the best fit to the files in DIR."


def fit_command(
    recordings: Recordings,
    laws: Annotated[list[str] | None, typer.Option("--law", metavar="NAME", help=_LAW_HELP)] = None,
    system: SystemName = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to write fit.json and report.html."),
    ] = None,
    sidecar: SidecarFile = None,
    free: Free = None,
    fix: Fix = None,
    prior: Prior = None,
    loss: LossName = "squares",
    holdout: Annotated[
        str,
        typer.Option("--holdout", metavar="SHARE|RECORDING", help=_HOLDOUT_HELP),
    ] = "0",
    together: Annotated[bool, typer.Option("--together", help=_TOGETHER_HELP)] = False,
    profiles: Annotated[bool, typer.Option("--profiles", help=_PROFILES_HELP)] = False,
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", min=0, max=2**32 - 1, help=_SEED_HELP)
    ] = 0,
    force: Force = False,
) -> None:
    """Fit contact laws to a recording, with 95 % intervals and verdicts.

    The file has a header that names quantity and unit, "time [s], angle [deg]", or is a list of
    "impact time [s]", or a sound (WAV) of bounces; NumPy, MATLAB, HDF5 and NetCDF files will do
    too. A file NAME.toml beside it may say what is known of the experiment.
    Without --law, the usual ones are compared; without --system, it follows from the quantity.

    \b
    Examples:
      impactjax fit swing.csv
      impactjax fit swing.csv --law kelvin-voigt --law restitution --out results
      impactjax fit bounces.csv --system bouncing-ball --law restitution
      impactjax fit runs --law restitution --together
      impactjax fit swing.csv --holdout another.csv
    """  # noqa: D301  Click takes the backspace as "do not wrap"
    with refusals_told():
        check_names(laws or [], system)
        oscillator = None if system is None else OSCILLATORS[system]()
        once = files_of(recordings)
        said = options(free or [], fix or [], loss, prior or [])
        surveys = [surveyed(path, sidecar, oscillator, laws, said) for path in once]
        if together and len(once) < 2:
            raise Refusal("--together needs at least two recordings.")
        unseen = held_out(holdout, once)
        if isinstance(unseen, Path):
            unseen = prepared_for(surveyed(unseen, sidecar, oscillator, laws, said), said)
        if profiles and out is None:
            raise Refusal("--profiles needs --out.")
        targets = _targets(out, force)
        made = [prepared_for(found, said) for found in surveys]
        for found in surveys:
            typer.echo(f"{checked(found)}\n")
        comparisons = compared(made, seed, unseen)
        repeats = repeatability(comparisons) if together else None
    texts: tuple[str, ...] = ()
    if targets:  # computed before anything is written or printed
        command = shlex.join(["impactjax", *sys.argv[1:]])
        texts = report_texts(comparisons, command, repeats, profiles)
    for comparison, found in zip(comparisons, surveys, strict=True):
        print_fits(comparison, found.notes)
    if repeats is not None:
        print_repeats(repeats)
    if targets:
        with refusals_told():
            write(targets, texts, force)


def _targets(out: Path | None, force: bool) -> tuple[Path, ...]:
    """The files to write. Creates their folder, and raises `Refusal` if a file exists."""
    if out is None:
        return ()
    targets = report_files(out)
    in_folder(out, targets, force)
    return targets
