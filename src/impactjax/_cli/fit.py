"""The command `impactjax fit`."""

import contextlib
import dataclasses
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer

from impactjax._check.check import checked
from impactjax._cli.compiler_flags import compiled_programs
from impactjax._cli.files import in_folder
from impactjax._cli.options import (
    Fix,
    Force,
    Free,
    LossName,
    Options,
    Recordings,
    SidecarFile,
    SystemName,
    files_of,
    options,
    surveyed,
)
from impactjax._cli.progress import telling
from impactjax._cli.refusal import Refusal, check_names
from impactjax._cli.tables import print_fits, print_repeats
from impactjax._cli.trace_cache import kept
from impactjax._compare.compare import compare_by
from impactjax._compare.comparison import Comparison
from impactjax._compare.laws import LAWS, NO_LAW
from impactjax._compare.oscillators import OSCILLATORS
from impactjax._compare.prepare import Prepared, prepared
from impactjax._compare.repeatability import repeatability
from impactjax._compare.survey import Survey
from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import evaluate
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._known import known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.build_problem import build_problem
from impactjax._problem.problem import Problem
from impactjax._record.file_error import FileError
from impactjax._report.write import report_files, report_texts, write_texts

_MOST_AT_ONCE = 4  # laws in parallel; each needs a gigabyte to compile

_SEED_HELP = "Random seed for scattered starts."
_HOLDOUT_HELP = "Share of the record, at its end, that is not fitted but predicted by each law."
_TOGETHER_HELP = "The recordings are repeats of one experiment: means, and scatter between them."
_LAW_HELP = f"A law to fit: {NO_LAW} (free flight), {', '.join(LAWS)}. May be given several times."


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
    loss: LossName = "squares",
    holdout: Annotated[
        float,
        typer.Option("--holdout", metavar="SHARE", min=0.0, max=0.9, help=_HOLDOUT_HELP),
    ] = 0.0,
    together: Annotated[bool, typer.Option("--together", help=_TOGETHER_HELP)] = False,
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
    """  # noqa: D301  Click takes the backspace as "do not wrap"
    try:
        check_names(laws or [], system)
        oscillator = None if system is None else OSCILLATORS[system]()
        once = files_of(recordings)
        said = options(free or [], fix or [], loss)
        surveys = [surveyed(path, sidecar, oscillator, laws, said) for path in once]
        if together and len(once) < 2:
            raise Refusal("--together needs at least two recordings.")
        targets = _targets(out, force)
        made = [_prepared(found, said) for found in surveys]
        for found in surveys:
            typer.echo(f"{checked(found)}\n")
        comparisons = _compared(made, seed, holdout)
        repeats = repeatability(comparisons) if together else None
    except (FileError, Refusal) as error:
        typer.echo(f"impactjax: {error}", err=True)
        raise typer.Exit(2) from error
    texts: tuple[str, ...] = ()
    if targets:  # computed before anything is written or printed
        command = shlex.join(["impactjax", *sys.argv[1:]])
        texts = report_texts(comparisons, command, repeats)
    for comparison, found in zip(comparisons, surveys, strict=True):
        print_fits(comparison, found.notes)
    if repeats is not None:
        print_repeats(repeats)
    if targets:
        try:
            write_texts(targets, texts, force)
        except FileExistsError as error:
            typer.echo(f"impactjax: {error.filename} exists by now; use another --out.", err=True)
            raise typer.Exit(2) from error
        except OSError as error:
            typer.echo(f"impactjax: {out} cannot be written to ({error.strerror}).", err=True)
            raise typer.Exit(2) from error
        typer.echo(f"Written: {', '.join(str(path) for path in targets)}")


def _prepared(found: Survey, said: Options) -> Prepared:
    """The experiments for a survey, which can be posed. Raises `Refusal` for those that cannot."""
    try:
        loss = said.loss_for(found.recording)
        made = prepared(found)
        own = {name: dataclasses.replace(e, loss=loss) for name, e in made.experiments.items()}
        for experiment in own.values():
            build_problem(experiment)
    except ValueError as error:
        raise Refusal(f"{found.name}: {error}") from error
    return made._replace(experiments=own)


def _targets(out: Path | None, force: bool) -> tuple[Path, ...]:
    """The files to write. Creates their folder, and raises `Refusal` if a file exists."""
    if out is None:
        return ()
    targets = report_files(out)
    in_folder(out, targets, force)
    return targets


def _compared(prepared: Sequence[Prepared], seed: int, holdout: float) -> list[Comparison]:
    folder = compiled_programs()
    search = Search() if folder is None else Search(kept(evaluate, folder / "traced"))
    starts, optimiser, comparisons = Starts(16, seed), LevenbergMarquardt(), []
    with _at_once() as pool:
        for each in prepared:
            try:
                with telling(Path(each.name).name) as tell:
                    begun = _together(tell)
                    found = compare_by(search, each, starts, optimiser, begun, pool.map, holdout)
            except ValueError as error:
                raise Refusal(f"{each.name}: {error}") from error
            fits = tuple(fit._replace(estimate=_known(fit.estimate)) for fit in found)
            comparisons.append(dataclasses.replace(found, fits=fits))
    return comparisons


def _together(tell: Callable[[str], None]) -> Callable[[str], None]:
    """A function that tells all that was begun, which goes on in parallel."""
    begun = list[str]()

    def told(what: str) -> None:
        begun.append(what)
        tell("; ".join(begun))

    return told


def _known(estimate: Estimate[Problem]) -> Estimate[Problem]:
    """The estimate with NumPy arrays, so that printing it compiles nothing."""
    return dataclasses.replace(known(estimate), problem=estimate.problem)


@contextlib.contextmanager
def _at_once() -> Iterator[ThreadPoolExecutor]:
    """A pool of threads, one for each law; JAX releases the interpreter while it compiles and runs.
    An interrupt of the command does not wait for them.
    """
    pool = ThreadPoolExecutor(min(_MOST_AT_ONCE, os.cpu_count() or 1))
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
