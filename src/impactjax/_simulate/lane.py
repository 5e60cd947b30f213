"""What a lane is to do, what it carries from pass to pass, and what it leaves behind."""

from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._results import RESULTS
from impactjax._simulate.chatter import Scale
from impactjax._simulate.state import Mode, State
from impactjax._simulate.step import Point
from impactjax._types import Flag, Scalar


class Run(eqx.Module):
    """What a lane is to do: go from the state `y0` at `t0` to `t1`."""

    model: ImpactOscillator
    y0: State
    t0: Scalar
    t1: Scalar
    tolerance: Scalar
    in_order: Flag  # whether the times asked for are


class Log(NamedTuple):
    """The steps of a lane, a row a pass."""

    t: Array  # start
    y: State  # at the start
    mode: Mode  # during the step
    h: Array  # duration; zero where the pass took no step
    end: State  # at the end, before any jump
    event: Array  # the transition at the end, or NO_EVENT
    taken: Array  # whether the pass took a step


class Lane(NamedTuple):
    """What a lane carries from pass to pass."""

    point: Point
    begun: Scalar  # when its phase did [s]
    memory: PyTree
    scale: Scale
    motion: Scalar  # the largest so far: how far from zero, or how long a way, of the coordinate
    speed: Scalar  # the largest so far, in units of the coordinate
    result: RESULTS
    done: Flag


class Record(NamedTuple):
    """All that the loop leaves behind."""

    log: Log
    end: Point
    result: RESULTS
    passes: Array  # of the whole batch, at least 1: one plain number, however many lanes there are
    chatters: Array  # whether any lane of the batch has a summed chatter; likewise
