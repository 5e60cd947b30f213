"""What every entrant hands over for a task."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Run = Callable[[], np.ndarray]


@dataclass(frozen=True)
class Prepared:
    """A task ready to run: everything compiled, nothing computed yet.

    `run` does the whole work once for `lanes` trajectories and returns an array: (1401,) in T1,
    (lanes, 1401) in T2, (parameters, 1401) or (lanes, parameters, 1401) in T3, (22001,) or
    (lanes, 50) in T4, the estimate in T5. A slow entrant does only every `stride`-th lane.
    """

    run: Run
    how: str
    build_seconds: float
    lanes: int = 1
    stride: int = 1


def prepare(build: Callable[[], Run], how: str, lanes: int = 1, stride: int = 1) -> Prepared:
    """Builds a task and runs it once, so that compilation is counted as building."""
    start = time.perf_counter()
    run = build()
    run()
    return Prepared(run, how, time.perf_counter() - start, lanes, stride)
