"""The command `impactjax check`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from impactjax._check.check import checked
from impactjax._cli.files import in_folder
from impactjax._cli.options import (
    Fix,
    Force,
    Free,
    Recordings,
    SidecarFile,
    SystemName,
    files_of,
    options,
    surveyed,
)
from impactjax._cli.refusal import Refusal, check_names, refusals_told
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._report.check_figure import write_check

_SUFFIX = "-check.png"  # added to the name of a recording


def check_command(
    recordings: Recordings,
    system: SystemName = None,
    free: Free = None,
    fix: Fix = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to draw the record, NAME-check.png."),
    ] = None,
    sidecar: SidecarFile = None,
    force: Force = False,
) -> None:
    """Look at a recording before any fit: what was read, noise, impacts, what looks wrong, and
    which parameters such a record can bound. It takes seconds.

    `fit` prints the same first. With --out, the record is drawn with its impacts marked.

    \b
    Examples:
      impactjax check swing.csv
      impactjax check swing.csv bounces.wav --out results
      impactjax check drop.csv --system bouncing-ball
    """  # noqa: D301  Click takes the backspace as "do not wrap"
    with refusals_told():
        check_names([], system)
        said = options(free or [], fix or [])
        oscillator = None if system is None else OSCILLATORS[system]()
        once = files_of(recordings)
        checks = [checked(surveyed(path, sidecar, oscillator, None, said)) for path in once]
        targets = _targets(out, once, force)
        for check in checks:
            typer.echo(f"{check}\n")
        try:
            for target, check in zip(targets, checks, strict=bool(targets)):
                write_check(target, check, force)
        except OSError as error:
            raise Refusal(f"{out} cannot be written to ({error.strerror}).") from error
    if targets:
        typer.echo(f"Written: {', '.join(str(path) for path in targets)}")


def _targets(out: Path | None, recordings: Sequence[Path], force: bool) -> list[Path]:
    """The pictures to write, one for each recording. Creates their folder."""
    if out is None:
        return []
    targets = [out / f"{path.stem}{_SUFFIX}" for path in recordings]
    if len({*targets}) < len(targets):
        raise Refusal("two recordings have one name, and so would their pictures; omit --out.")
    in_folder(out, targets, force)
    return targets
