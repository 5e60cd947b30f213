"""`impactjax fit`."""

import contextlib
import dataclasses
import json
import os
import shlex
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from impactjax._cli.compiler_flags import compiled_programs
from impactjax._cli.refusal import Refusal, check_names
from impactjax._cli.setup import Task, task_of
from impactjax._cli.trace_cache import kept
from impactjax._compare.compare import Fitted, compare_by
from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.ranking import rejected
from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import evaluate
from impactjax._fit.search import Search
from impactjax._known import known
from impactjax._number_format import interval, with_unit
from impactjax._record.file_error import FileError
from impactjax._record.read_recording import read_recording
from impactjax._report.document import document
from impactjax._report.given import given
from impactjax._report.page import page
from impactjax._report.rows import verdict_of
from impactjax._report.units import shown_unit
from impactjax._report.words import sentences

_WIDTH = 120  # of a table that is not on a terminal
_MOST_AT_ONCE = 4  # laws: a gigabyte each while they compile

_LAW_HELP = f"A law to fit: {NO_LAW} (free flight), {', '.join(LAWS)}. May be given several times."


def fit_command(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING", help="File, or several.")
    ],
    laws: Annotated[list[str] | None, typer.Option("--law", metavar="NAME", help=_LAW_HELP)] = None,
    system: Annotated[
        str | None,
        typer.Option("--system", metavar="NAME", help=f"What moves: {', '.join(OSCILLATORS)}."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to write fit.json and report.html."),
    ] = None,
    sidecar: Annotated[
        Path | None,
        typer.Option("--sidecar", metavar="FILE", help="TOML file to use instead of NAME.toml."),
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", min=0, max=2**32 - 1, help="Of scattered starts.")
    ] = 0,
    force: Annotated[bool, typer.Option("--force", help="Overwrite files in DIR.")] = False,
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
    """  # noqa: D301  Click knows the backspace as "do not wrap"
    try:
        check_names(laws or [], system)
        once = dict.fromkeys(recordings)
        tasks = [task_of(read_recording(path, sidecar), system, laws) for path in once]
        targets = _targets(out, force)
        fits = _fitted(tasks, seed)
    except (FileError, Refusal) as error:
        typer.echo(f"impactjax: {error}", err=True)
        raise typer.Exit(2) from error
    notes = {str(task.path): task.notes for task in tasks}
    written: list[tuple[Path, str]] = []
    if targets is not None:  # all is made before anything is written or said
        command = shlex.join(["impactjax", *sys.argv[1:]])
        texts = json.dumps(document(fits, seed, notes), indent=2) + "\n"
        written = [*zip(targets, (texts, page(fits, command, seed, notes)), strict=True)]
    for name in dict.fromkeys(name for name, _ in fits):
        own = [fitted for recording, fitted in fits if recording == name]
        _print(name, own, notes[name])
    if written:
        try:
            for path, text in written:
                write(path, text, force)
        except FileExistsError as error:
            typer.echo(f"impactjax: {error.filename} exists by now; use another --out.", err=True)
            raise typer.Exit(2) from error
        except OSError as error:
            typer.echo(f"impactjax: {out} cannot be written to ({error.strerror}).", err=True)
            raise typer.Exit(2) from error
        typer.echo(f"Written: {', '.join(str(path) for path, _ in written)}")


def _targets(out: Path | None, force: bool) -> tuple[Path, Path] | None:
    """The files to write, none of which may exist, in a folder that is made if it does not."""
    if out is None:
        return None
    targets = out / "fit.json", out / "report.html"
    for target in targets:
        if os.path.lexists(target) and not force:
            raise Refusal(f"{target} exists; use --force to overwrite it, or another --out.")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Refusal(f"{out} cannot be a folder ({error.strerror}); choose another.") from error
    if not os.access(out, os.W_OK):
        raise Refusal(f"{out} cannot be written to; choose another.")
    return targets


def write(path: Path, text: str, force: bool) -> None:
    """Nothing is overwritten that came to be while the fits ran."""
    with path.open("w" if force else "x", encoding="utf-8") as file:
        file.write(text)


def _fitted(tasks: Sequence[Task], seed: int) -> list[tuple[str, Fitted]]:
    fits = []
    folder = compiled_programs()
    search = Search() if folder is None else Search(kept(evaluate, folder / "traced"))
    console = Console(stderr=True)
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    with progress as bar, _at_once() as pool:
        display = bar.add_task("", total=None)
        for task in tasks:
            path, begun = task.path, list[str]()

            def tell(what: str, path: Path = path, begun: list[str] = begun) -> None:
                begun.append(what)
                bar.update(display, description=f"{escape(path.name)}: {'; '.join(begun)}")

            try:
                found = compare_by(
                    search, task.recording, task.setup, task.laws, seed, tell, pool.map
                )
            except ValueError as error:
                raise Refusal(f"{path}: {error}") from error
            fits += [(str(path), fitted) for fitted in found]
    return [(name, fitted._replace(estimate=_known(fitted.estimate))) for name, fitted in fits]


def _known(estimate: Estimate) -> Estimate:
    """With what was found as NumPy's numbers, to print which compiles nothing."""
    return dataclasses.replace(known(estimate), problem=estimate.problem)


@contextlib.contextmanager
def _at_once() -> Iterator[ThreadPoolExecutor]:
    """Threads for laws: what JAX compiles and runs leaves Python to the others. Who interrupts the
    command does not wait for them.
    """
    pool = ThreadPoolExecutor(min(_MOST_AT_ONCE, os.cpu_count() or 1))
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _print(name: str, fits: Sequence[Fitted], notes: Sequence[str]) -> None:
    console = Console()
    unit, factor = shown_unit(fits[0].estimate.problem.recording)
    table = Table(title=escape(name), title_justify="left", title_style="bold")
    for heading in (
        "law",
        "rms",
        "parameter",
        "value ± standard error",
        "95 % interval",
        "verdict",
    ):
        table.add_column(heading, no_wrap=True)
    ruled_out = rejected([fitted.estimate for fitted in fits])
    for fitted, out in zip(fits, ruled_out, strict=True):
        estimate = fitted.estimate
        law = f"{fitted.law} + dry friction" if fitted.dry_friction else fitted.law
        rms, known = f"{float(estimate.rms) * factor:.4g} {unit}", given(fitted)
        for i, parameter in enumerate(estimate.names):
            error = float(estimate.standard_errors[i])
            value = estimate.quoted(parameter)
            own = "" if estimate.units[i] == "1" else f" {estimate.units[i]}"
            table.add_row(
                law if i == 0 else "",
                rms if i == 0 else "",
                parameter,
                value + own,
                interval(float(estimate.low[i]), float(estimate.high[i]), error),
                f"{verdict_of(estimate, parameter, out)}{known.words(parameter)}",
            )
            if (free := known.own.get(parameter)) is not None:
                table.add_row("", "", free.name, with_unit(free.shown, free.unit), "", "")
        table.add_section()
    if not console.is_terminal:
        endless = console.options.update(width=10 * _WIDTH)
        console.width = max(_WIDTH, Measurement.get(console, endless, table).maximum)
    console.print(table)
    if not console.is_terminal:
        console.width = _WIDTH
    for sentence in (*notes, *sentences(fits)):
        console.print(f"- {sentence}", highlight=False, markup=False)
    console.print()
