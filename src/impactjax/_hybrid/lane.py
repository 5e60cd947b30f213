"""Data of a lane: its start, its state between passes, and its log."""

from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, ArrayLike, Bool, PyTree

from impactjax._hybrid.system import Mode, State
from impactjax._results import RESULTS
from impactjax._types import Code, Flag, Scalar


class Memory(NamedTuple):
    """Memory of a lane from one step to the next.

    - `armed`: true for each guard that has been positive since its last event.
    - `arrival`: the event that led here, or `NO_EVENT`.
    - `stays`: true if that event's jump left its guard at zero.
    - `repeats`: number of times that the event has repeated without time passing.
    - `since`: time from which the state holds: earlier than its own after a series taken at once.
    - `ended`: true if an event has ended the run.
    - `step`: the step's own memory.
    """

    armed: Bool[Array, " guards"]
    arrival: Code
    stays: Flag
    repeats: Code
    since: Scalar
    ended: Flag
    step: PyTree


class Start(eqx.Module):
    """Start of a run of a hybrid system.

    - `t`: time.
    - `y`: state, any tree of numbers and arrays.
    - `mode`: mode, any tree of whole numbers; 0 if left out.
    - `memory`: `None`, or what the lane remembers, in the `final` of a `Solution`.
    """

    t: ArrayLike
    y: State
    mode: Mode = 0
    memory: Memory | None = None


class Point(NamedTuple):
    """Start of a step."""

    t: Scalar
    y: State
    mode: Mode
    memory: Memory


class Run(eqx.Module):
    """Task of a lane: to go from its start to `t1`.

    - `arrays`: the arrays of the equations.
    - `mark`, `marks`: the lane stops earlier at this number of events of this transition.
    """

    arrays: PyTree
    start: Point
    t1: Scalar
    tolerance: Scalar
    scale: State  # sizes below which numbers need no accuracy
    mark: Code
    marks: Code
    verdict: RESULTS  # why it cannot run, or successful


class Log(NamedTuple):
    """The steps of a lane, one row for each pass."""

    t: Array  # start
    y: State  # at the start
    mode: Mode  # during the step
    h: Array  # duration
    unit: Array  # of time, in which the step is expanded
    end: State  # at the end, before any jump
    event: Array  # the transition at the end, or NO_EVENT
    caused: Array  # true if the jump before has caused it, at the same time
    next_t: Array  # start of the next step
    next_y: State
    next_mode: Mode
    taken: Array  # true if the pass took a step
    last: Array  # true for a step beyond the end of the run


class Lane(NamedTuple):
    """State of a lane between passes."""

    point: Point
    marks: Code  # number of events of the transition that is counted
    result: RESULTS
    done: Flag


class Record(NamedTuple):
    """Result of the loop."""

    log: Log
    final: Point
    result: RESULTS
    passes: Array  # of the whole batch, at least 1; not batched
