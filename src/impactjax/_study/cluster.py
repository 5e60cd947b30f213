"""Computation of chunks by the workers of a Dask cluster."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from impactjax._study.design import Points
from impactjax._study.extra import needed
from impactjax._study.program import Program, Results, evaluated
from impactjax._study.study_error import StudyError

if TYPE_CHECKING:
    import distributed

_AHEAD = 2  # chunks for each thread that computes: one at work, one waiting


def check_client(client: "distributed.Client") -> None:
    """Raises `TypeError` for an object that is no client of a cluster which waits for results."""
    kind = needed("distributed").Client
    if not isinstance(client, kind) or client.asynchronous:
        raise TypeError(
            "Argument `client` must be a `distributed.Client` that is not asynchronous, but it is "
            f"{client!r}."
        )


def evaluated_by(
    client: "distributed.Client",
    program: Program,
    points: Callable[[int], Points],
    chunks: Sequence[int],
) -> Iterator[tuple[int, Results]]:
    """Numbers of chunks with their results, in the order in which workers finish them.

    A chunk whose worker dies is given to another. **Raises** `StudyError` if several die with the
    same chunk, or if a worker has another version of JAX.
    """
    distributed = needed("distributed")
    waiting = iter(chunks)

    def submitted(count: int) -> "list[distributed.Future[Any]]":
        return [
            client.submit(_numbered, number, program, points(number), _versions(), pure=False)
            for number in itertools.islice(waiting, count)
        ]

    threads: Any = client.nthreads()  # by worker
    begun = submitted(_AHEAD * max(1, sum(threads.values())))
    running = distributed.as_completed(begun)
    try:
        for future in running:
            number, results = _result(distributed.KilledWorker, future)
            for each in submitted(1):
                running.add(each)
            yield number, results
    finally:
        running.clear()


def _numbered(
    number: int, program: Program, points: Points, versions: tuple[str, str]
) -> tuple[int, Results]:
    if versions != _versions():
        raise StudyError(
            f"A worker has other versions of JAX and jaxlib ({_versions()}) than the process that "
            f"asks ({versions}); install the same ones."
        )
    return number, evaluated(program, points)


def _versions() -> tuple[str, str]:
    return version("jax"), version("jaxlib")


def _result(killed: type[Exception], future: "distributed.Future[Any]") -> tuple[int, Results]:
    try:
        return future.result()
    except killed as error:
        raise StudyError(
            f"Several workers died with the same chunk ({error}); give them more memory, or the "
            "study smaller chunks."
        ) from error
