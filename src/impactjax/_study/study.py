"""The verb `study`: function and design → results in a folder."""

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from impactjax._refusal import check_function, check_kind, whole
from impactjax._study.chunks import Chunks, by_cost, record_type
from impactjax._study.cluster import check_client, evaluated_by
from impactjax._study.design import AbstractDesign, checked_points
from impactjax._study.folder import MANIFEST, Folder, alone, folder_of, write
from impactjax._study.manifest import as_text, check_same, manifest_of, read_manifest
from impactjax._study.program import LaneFunction, Program, Results, evaluated, traced
from impactjax._study.progress import Progress
from impactjax._study.study_result import Study, study_in
from impactjax._terminal import telling

if TYPE_CHECKING:
    import distributed

Tell = Callable[[Progress], object]

_BLOCKS = 8  # parts of a chunk, each computed at once by one device


def study(
    function: LaneFunction,
    design: AbstractDesign,
    store: str | Path,
    *,
    chunk: int = 1024,
    cost: Callable[..., ArrayLike] | None = None,
    units: Mapping[str, str] | None = None,
    client: "distributed.Client | None" = None,
    progress: Tell | None = None,
) -> Study:
    """Results of a function at all points of a design, in a folder that outlives the process.

    Lanes are computed chunk by chunk. Each chunk is one file, which is complete or absent at any
    moment; the same call again goes on from the chunks that are there, and the files that result
    have the same bytes as those of a run without interruption. A chunk that is damaged or of
    another study is computed anew, and `Study.notes` says so. All devices of the process share the
    lanes of a chunk.

    **Arguments:**

    - `function`: function of the parameters of one lane, by name, such as
      `lambda gamma, omega0: {"speed": ..., "result": run.result}`. JAX must be able to trace it.
      It returns arrays of any shape in a dictionary or another tree; a lane with a result code
      other than `RESULTS.successful` has failed, and so has one with NaN if there is no code.
    - `design`: the points, such as `Grid(gamma=..., omega0=...)`.
    - `store`: folder of the study; created if it does not exist.
    - `chunk`: number of lanes in a file, and the most that an interruption loses. An eighth of
      them is computed at once by one device.
    - `cost`: function of the same parameters that estimates how long a lane takes, in any unit.
      Lanes of similar cost are then computed together, the longest first, since a batch takes as
      long as its longest lane. Results are in the order of the design in any case.
    - `units`: units of parameters and results, by name.
    - `client`: client of a Dask cluster, whose workers compute the chunks.
    - `progress`: function that is told the `Progress` at first and after each chunk, such as
      `print`. By default a terminal shows it while the study runs.

    **Raises** `StudyError` if the folder holds another study (another function, design, or version
    of a library), or if a file cannot be written, `ImportError` without the extra that `client`
    needs, and `TypeError` or `ValueError` for arguments of another kind.
    """
    check_kind("design", design, AbstractDesign, "Grid(gamma=[0.1, 0.2])")
    if client is not None:
        check_client(client)
    if progress is not None:
        check_function("progress", progress)
    points = checked_points(design).astype(jnp.result_type(float))
    chunk = whole("chunk", chunk)
    block = -(-min(chunk, len(points)) // _BLOCKS)
    found = traced(function, design, block)
    _check_units(units or {}, [*design.names, *(each.name for each in found.variables)])
    order = None if cost is None else by_cost(cost, design.names, points)
    asked = manifest_of(function, found, design, points, order, chunk, units or {})
    lanes = np.arange(len(points)) if order is None else order
    chunks = Chunks(points, lanes, chunk, record_type(asked))
    path = Path(store)
    with alone(path):
        if not (path / MANIFEST).exists():
            write(path / MANIFEST, as_text(asked))
        check_same(path, read_manifest(path), asked)
        with _telling(path.name, progress) as tell:
            notes = _complete(folder_of(path), chunks, found.program, client, tell)
    return study_in(path, notes)


def _complete(
    folder: Folder,
    chunks: Chunks,
    program: Program,
    client: "distributed.Client | None",
    tell: Tell,
) -> tuple[str, ...]:
    """Computes and writes the chunks that a folder lacks. Returns notes about damaged ones."""
    numbers = range(chunks.total)
    damaged = [n for n in numbers if folder.chunk(n).exists() and folder.read(n) is None]
    missing = [n for n in numbers if n in damaged or not folder.chunk(n).exists()]
    notes = tuple(
        f"{folder.chunk(number)} was damaged or of another study, and was computed anew."
        for number in damaged
    )
    missing_lanes = sum(len(chunks.lanes_of(number)) for number in missing)
    now = Progress(len(chunks.lanes), len(chunks.lanes) - missing_lanes, note=" ".join(notes))
    tell(now)
    since: tuple[int, float] | None = None  # lanes and time after the first chunk
    for number, results in _results(client, program, chunks, missing):
        folder.write(number, chunks.records(number, results))
        done, clock = now.done + len(chunks.lanes_of(number)), time.monotonic()
        since = since or (done, clock)
        rate = (done - since[0]) / (clock - since[1]) if done > since[0] else math.nan
        now = Progress(now.lanes, done, rate)
        tell(now)
    return notes


@contextlib.contextmanager
def _telling(name: str, progress: Tell | None) -> Iterator[Tell]:
    """The given function; by default one that shows the progress on a terminal."""
    if progress is not None:
        yield progress
        return
    with telling(name) as show:
        yield lambda now: show(str(now))


def _check_units(units: Mapping[str, str], names: Sequence[str]) -> None:
    """Raises `ValueError` for a unit of something that is not there, or that is no text."""
    check_kind("units", units, Mapping, "{'gamma': '1'}")
    for name, unit in units.items():
        check_kind("units", unit, str, "'m/s'")
        if name not in names:
            raise ValueError(
                f"Argument `units` names `{name}`, but there are only {', '.join(names)}."
            )


def _results(
    client: "distributed.Client | None", program: Program, chunks: Chunks, numbers: Sequence[int]
) -> Iterator[tuple[int, Results]]:
    """Numbers of chunks with their results, computed here or by a cluster."""
    if client is not None:
        return evaluated_by(client, program, chunks.points_of, numbers)
    return ((number, evaluated(program, chunks.points_of(number))) for number in numbers)
