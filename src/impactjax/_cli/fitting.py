"""Fits of recordings by a command, with their progress."""

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from impactjax._cli.compiler_flags import compiled_programs
from impactjax._cli.options import Options
from impactjax._cli.refusal import Refusal
from impactjax._cli.trace_cache import kept
from impactjax._compare.compare import compare_by
from impactjax._compare.comparison import Comparison
from impactjax._compare.prepare import Prepared, prepared
from impactjax._compare.survey import Survey
from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import evaluate
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._known import known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.build_problem import build_problem
from impactjax._problem.problem import Problem
from impactjax._terminal import telling

_MOST_AT_ONCE = 4  # laws in parallel; each needs a gigabyte to compile


def prepared_for(found: Survey, said: Options) -> Prepared:
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


def compared(
    prepared: Sequence[Prepared], seed: int, holdout: float | Prepared = 0.0
) -> list[Comparison]:
    """The laws of each recording, fitted and compared. Raises `Refusal` for one that cannot be."""
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
