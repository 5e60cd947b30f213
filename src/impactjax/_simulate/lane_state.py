"""State of a lane: what the next step, or the next run, needs to go on."""

from collections.abc import Hashable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from impactjax._hybrid.numbers import time_scale
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._simulate.automaton import NO_EVENT, Automaton, initial_mode, with_internal
from impactjax._simulate.chatter import Scale
from impactjax._simulate.flow import unheld_acceleration
from impactjax._simulate.state import State
from impactjax._simulate.step import AbstractStep, Point
from impactjax._types import Scalar


class LaneState(eqx.Module):
    """State of a lane, from which a later run goes on as if there had been no cut.

    No step is cut at the end of a run. The state is therefore that at the start of the last step,
    a little before the last sample.

    - `point`: time, state and mode, and the event that led there.
    - `origin`: time at which the first run began [s].
    - `begun`: beginning of the phase [s].
    - `scale`: greatest approach speed and longest flight so far.
    - `motion`: the largest so far: how far from zero, or how long a way, of the coordinate.
    - `speed`: the largest so far, in units of the coordinate.
    - `memory`: the step's own.
    - `kind`: structure of the model: a later run needs one of the same.
    """

    point: Point
    origin: Scalar
    begun: Scalar
    scale: Scale
    motion: Scalar
    speed: Scalar
    memory: PyTree
    kind: Hashable = eqx.field(static=True)


def lane_state_at(
    step: AbstractStep, model: ImpactOscillator, t: Scalar, initial: InitialState
) -> LaneState:
    """State of a lane at the start of its first run."""
    y = with_internal(model, initial.position, initial.velocity)
    mode, _ = initial_mode(model, t, y)

    def free(t: Scalar, y: State) -> State:
        rates = Automaton(model).flow(t, y, mode)
        return rates._replace(position=y.velocity, velocity=unheld_acceleration(model, t, y, mode))

    zero = jnp.zeros_like(t)
    return LaneState(
        Point(t, y, mode, jnp.int32(NO_EVENT)),
        t,
        t,
        Scale(zero, zero),
        jnp.abs(y.position),
        jnp.abs(y.velocity),
        step.begin(jax.lax.stop_gradient(time_scale(free, t, y))),
        jax.tree.structure(model),
    )
