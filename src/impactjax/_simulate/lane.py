"""Data of a lane: its task, its state between passes, and its log."""

from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._results import RESULTS
from impactjax._simulate.chatter import Scale
from impactjax._simulate.state import Mode, State
from impactjax._simulate.step import Point
from impactjax._types import Code, Factors, Flag, Scalar


class Run(eqx.Module):
    """Task of a lane: to go from the state `y0` at `t0` to `t1`.

    - `factors`: factor on the speed after each impact, or `None`.
    """

    model: ImpactOscillator
    y0: State
    t0: Scalar
    t1: Scalar
    tolerance: Scalar
    in_order: Flag  # true if the sample times increase
    factors: Factors | None = None


class Log(NamedTuple):
    """The steps of a lane, one row for each pass."""

    t: Array  # start
    y: State  # at the start
    mode: Mode  # during the step
    h: Array  # duration; zero where the pass took no step
    end: State  # at the end, before any jump
    event: Array  # the transition at the end, or NO_EVENT
    taken: Array  # true if the pass took a step


class Lane(NamedTuple):
    """State of a lane between passes."""

    point: Point
    begun: Scalar  # beginning of its phase [s]
    memory: PyTree
    scale: Scale
    motion: Scalar  # the largest so far: how far from zero, or how long a way, of the coordinate
    speed: Scalar  # the largest so far, in units of the coordinate
    impacts: Code  # number of impacts that have begun
    result: RESULTS
    done: Flag


class Record(NamedTuple):
    """Result of the loop."""

    log: Log
    end: Point
    result: RESULTS
    passes: Array  # of the whole batch, at least 1; not batched
    chatters: Array  # true if any lane of the batch has a summed chatter; not batched


def factors_of(factors: Factors, number: Array, beyond: float = 1.0) -> Array:
    """The factors of the impacts with some numbers from 0; 1 for those that have none."""
    return factors.at[number].get(mode="fill", fill_value=beyond, wrap_negative_indices=False)
