"""The command `impactjax thesis`."""

import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from impactjax._cli.files import in_folder, write
from impactjax._cli.options import Force
from impactjax._cli.refusal import Refusal, refusals_told
from impactjax._report.thesis_report import picture_name, thesis_texts
from impactjax._terminal import telling
from impactjax._thesis.claim import Claim
from impactjax._thesis.drawing import Made
from impactjax._thesis.figures import FIGURES

_FILES = "thesis.json", "thesis.html"
_WIDTH, _DPI = 150, 144
_FIGURE_HELP = f"A figure: {', '.join(FIGURES)}; all by default. May be given several times."


def thesis_command(
    figures: Annotated[
        list[str] | None, typer.Option("--figure", metavar="NUMBER", help=_FIGURE_HELP)
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to write pictures and the table."),
    ] = None,
    force: Force = False,
) -> None:
    """Reproduce the figures of Carter's thesis, and judge what it says beside each by computing it.

    Its measurements are lost: simulated records with its sensor stand in their place.

    \b
    Examples:
      impactjax thesis --figure 3.4
      impactjax thesis --out thesis
    """  # noqa: D301  Click takes the backspace as "do not wrap"
    with refusals_told():
        numbers = _numbers(figures or [])
        targets = _targets(out, numbers, force)
        made = dict(_made(numbers, out))
        claims = {number: each.claims for number, each in made.items()}
        _print([claim for each in claims.values() for claim in each])
        if targets:
            command = shlex.join(["impactjax", *sys.argv[1:]])
            write(targets, thesis_texts(claims, command), force)


def _numbers(figures: Sequence[str]) -> list[str]:
    """The numbers asked for, in the thesis's order. Raises `Refusal` for one that is unknown."""
    for each in figures:
        if each not in FIGURES:
            raise Refusal(f"there is no figure {each}; there are {', '.join(FIGURES)}.")
    return [number for number in FIGURES if not figures or number in figures]


def _targets(out: Path | None, numbers: Sequence[str], force: bool) -> list[Path]:
    """The files of the table. Creates the folder, and raises `Refusal` if any file exists."""
    if out is None:
        return []
    targets = [out / name for name in _FILES]
    in_folder(out, [*targets, *(out / picture_name(number) for number in numbers)], force)
    return targets


def _made(numbers: Sequence[str], out: Path | None) -> Iterator[tuple[str, Made]]:
    """Each figure, with a line when it is done. Raises `Refusal` if it cannot be written."""
    for number in numbers:
        with telling(f"Figure {number}"):
            made = FIGURES[number].make()
        if out is not None:
            try:
                made.picture.savefig(out / picture_name(number), dpi=_DPI)
            except OSError as error:
                raise Refusal(f"{out} cannot be written to ({error.strerror}).") from error
        typer.echo(f"{number:8} {FIGURES[number].title}")
        yield number, made


def _print(claims: Sequence[Claim]) -> None:
    """Prints the table of all claims."""
    console = Console()
    if not console.is_terminal:
        console.width = _WIDTH
    table = Table(show_lines=True)
    for heading in ("figure", "claim", "thesis", "computed", "verdict"):
        table.add_column(heading, no_wrap=heading in ("figure", "verdict"))
    for claim in claims:
        table.add_row(*map(escape, claim.row()))
    console.print(table, highlight=False)
