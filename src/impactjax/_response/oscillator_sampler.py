"""Forced impact oscillators from period to period."""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple, TypeAlias, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._response.period import Force
from impactjax._response.sampler import (
    AbstractSampler,
    Counts,
    Growth,
    Sampled,
    chosen,
    without_disturbances,
)
from impactjax._response.tangents import axes, orthogonal, pushed
from impactjax._results import RESULTS
from impactjax._simulate.lane_state import LaneState, lane_state_at
from impactjax._simulate.simulate import simulate
from impactjax._simulate.step import AbstractStep
from impactjax._types import Code, Flag, Scalar

Told = TypeVar("Told")

_ROWS = 64  # steps of an oscillator in one run, which the next one goes on
_MOST = 256  # runs in a period, after which a lane is given up
_TOGETHER = 20  # lanes: what they need together fits into the cache


class _Reached(NamedTuple):
    """An oscillator on the way to the end of a period, and its position and velocity there."""

    state: LaneState
    result: RESULTS
    runs: Code
    position: Scalar
    velocity: Scalar


_Both: TypeAlias = tuple[_Reached, PyTree]  # a motion and its disturbances


class OscillatorSampler(AbstractSampler[ImpactOscillator]):
    """Impact oscillators and `simulate`, which goes on from period to period."""

    force: Force
    tolerance: Scalar
    step: AbstractStep
    counts: Counts = eqx.field(static=True)

    def begun(self, system: ImpactOscillator, start: InitialState) -> LaneState:
        return lane_state_at(self.step, system, jnp.zeros_like(self.tolerance), start)

    def __call__(self, system: ImpactOscillator, begun: LaneState) -> Sampled:
        keep, skip = self.counts
        period = self._period(system)

        def to_end(before: _Reached, number: Scalar) -> tuple[_Reached, tuple[Scalar, Scalar]]:
            reached = self._to_end(system, before, period * number)
            return reached, (reached.position, reached.velocity)

        numbers = self._numbers(skip, skip + keep)
        reached, (x, v) = jax.lax.scan(to_end, _at_start(begun), numbers)
        good = reached.result == RESULTS.successful
        ended = _earlier(reached.state, period * (skip + keep))
        return Sampled({"position": x, "velocity": v}, chosen(good, ended, begun), reached.result)

    def growth(self, system: ImpactOscillator, begun: LaneState) -> Growth:
        """Two disturbances run beside the motion, through all its impacts, and are made orthogonal
        after each period.
        """
        keep, skip = self.counts
        period, alone = self._period(system), without_disturbances(skip)

        def to_end(before: _Both, number: Scalar) -> tuple[_Both, PyTree]:
            now, disturbances = jax.lax.while_loop(
                lambda both: self._waits(both[0]),
                lambda both: pushed(lambda now: self._further(system, now, period * number), *both),
                (_waiting(before[0]), before[1]),
            )
            ends = jnp.stack([disturbances.position, disturbances.velocity], axis=1)
            disturbances, logarithms = orthogonal(disturbances, ends)
            return (now, disturbances), logarithms

        settled = self._to_end(system, _at_start(begun), period * alone)
        y = settled.state.point.y
        first = y.position, y.velocity
        before = pushed(lambda own: _displaced(settled, *own), first, axes(first))
        numbers = self._numbers(alone, skip + keep)
        (reached, _), logarithms = jax.lax.scan(to_end, before, numbers)
        return Growth(logarithms[skip - alone :], reached.state, reached.result)

    def side_by_side(self, motion: Callable[[PyTree], Told], lanes: PyTree) -> Told:
        return jax.lax.map(motion, lanes, batch_size=_TOGETHER)

    def _period(self, model: ImpactOscillator) -> Scalar:
        return self.period(model).astype(self.tolerance.dtype)

    def _numbers(self, after: int, last: int) -> Float[Array, " periods"]:
        return jnp.arange(after + 1, last + 1, dtype=self.tolerance.dtype)

    def _to_end(self, model: ImpactOscillator, before: _Reached, end: Scalar) -> _Reached:
        """Runs the motion to the end of a period, if it has not failed before."""
        return jax.lax.while_loop(
            lambda now: self._waits(now),
            lambda now: self._further(model, now, end),
            _waiting(before),
        )

    def _waits(self, now: _Reached) -> Flag:
        """True while the end of the period is ahead."""
        most = min(_MOST * (self.counts.skip + 1), np.iinfo(np.int32).max)
        return (now.result == RESULTS.max_steps_reached) & (now.runs < most)

    def _further(self, model: ImpactOscillator, now: _Reached, end: Scalar) -> _Reached:
        """The motion some steps further, at most to the end of a period."""
        run = simulate(
            model,
            now.state,
            end[None],
            step=self.step,
            tolerance=self.tolerance,
            max_steps=_ROWS,
            max_impacts=_ROWS,
        )
        return _Reached(run.final, run.result, now.runs + 1, run.position[0], run.velocity[0])


def _at_start(state: LaneState) -> _Reached:
    """The start of a motion."""
    unknown = jnp.full_like(state.point.t, jnp.nan)
    return _Reached(state, RESULTS.successful, jnp.int32(0), unknown, unknown)


def _waiting(before: _Reached) -> _Reached:
    """The same before the next period, if it has not failed."""
    good = before.result == RESULTS.successful
    result = RESULTS.where(good, RESULTS.max_steps_reached, before.result)
    unknown = jnp.full_like(before.position, jnp.nan)
    return _Reached(before.state, result, jnp.int32(0), unknown, unknown)


def _displaced(reached: _Reached, position: Scalar, velocity: Scalar) -> _Reached:
    """The same motion with another position and velocity."""
    point = reached.state.point
    y = point.y._replace(position=position, velocity=velocity)
    state = dataclasses.replace(reached.state, point=point._replace(y=y))
    return reached._replace(state=state, position=position, velocity=velocity)


def _earlier(state: LaneState, time: Scalar) -> LaneState:
    """The same state at an earlier time."""
    point = state.point._replace(t=state.point.t - time)
    origin, begun = state.origin - time, state.begun - time
    return dataclasses.replace(state, point=point, origin=origin, begun=begun)
