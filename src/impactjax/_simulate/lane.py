"""Data of a lane: its task, its state between passes, and its log."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._results import RESULTS
from impactjax._simulate.automaton import NO_EVENT
from impactjax._simulate.lane_state import LaneState
from impactjax._simulate.state import Mode, State
from impactjax._types import Code, Factors, Flag, Scalar


class Run(eqx.Module):
    """Task of a lane: to go from its start to `t1`.

    - `factors`: factor on the speed after each impact, or `None`.
    """

    model: ImpactOscillator
    start: LaneState
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
    """A lane between passes."""

    state: LaneState
    impacts: Code  # number of impacts that have begun in this run
    result: RESULTS
    done: Flag


class Whole(NamedTuple):
    """The steps as they were taken, one row for each pass: the last one goes beyond the end of the
    run, so that a later run can take it again.
    """

    h: Array  # duration
    event: Array  # the transition at the end, or NO_EVENT


class Record(NamedTuple):
    """Result of the loop."""

    log: Log  # up to the end of the run, but the last step has the state at its own end
    whole: Whole
    final: LaneState
    t1: Array  # time up to which the motion is known
    result: RESULTS
    passes: Array  # of the whole batch, at least 1; not batched
    chatters: Array  # true if any lane of the batch has a summed chatter; not batched


def cut(log: Log, t1: Scalar) -> Log:
    """The steps up to a time, but the state at the end of the last one is not changed."""
    beyond = log.taken & (log.h > t1 - log.t)
    return log._replace(
        h=jnp.where(beyond, t1 - log.t, log.h), event=jnp.where(beyond, NO_EVENT, log.event)
    )


def factors_of(factors: Factors, number: Array, beyond: float = 1.0) -> Array:
    """The factors of the impacts with some numbers from 0; 1 for those that have none."""
    return factors.at[number].get(mode="fill", fill_value=beyond, wrap_negative_indices=False)
