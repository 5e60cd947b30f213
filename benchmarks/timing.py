"""Times two runs against each other, in turn, in one process."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

Run = Callable[[], object]


class Effort(NamedTuple):
    """How long to measure: seconds of a reading, readings, seconds of all readings of a run."""

    reading: float
    readings: int
    budget: float


FULL = Effort(0.03, 15, 15.0)
QUICK = Effort(0.005, 5, 2.0)
FEWEST = 3


class Timing(NamedTuple):
    """The median time of one call [s], and the quartiles' distance over the median."""

    median: float
    spread: float


def _once(run: Run, calls: int) -> float:
    start = time.perf_counter()
    for _ in range(calls):
        run()
    return (time.perf_counter() - start) / calls


def _calls(run: Run, effort: Effort) -> tuple[int, int]:
    """Calls in a reading, and readings, after a warm-up."""
    run()
    single = _once(run, 1)
    calls = max(1, round(effort.reading / single))
    readings = round(effort.budget / (single * calls))
    return calls, min(max(readings, FEWEST), effort.readings)


def _timing(readings: list[float]) -> Timing:
    low, middle, high = np.percentile(readings, (25, 50, 75))
    return Timing(float(middle), float((high - low) / middle))


def in_turn(runs: list[Run], effort: Effort) -> list[Timing]:
    """Times runs in turn (A B A B …), so that a disturbance meets all of them."""
    plans = [_calls(run, effort) for run in runs]
    times: list[list[float]] = [[] for _ in runs]
    for _ in range(max(readings for _, readings in plans)):
        for run, (calls, _), readings in zip(runs, plans, times, strict=True):
            readings.append(_once(run, calls))
    return [_timing(readings) for readings in times]
