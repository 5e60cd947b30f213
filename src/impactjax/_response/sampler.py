"""Stroboscopic states of a motion at one value of a parameter."""

import abc
import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PyTree

from impactjax._hybrid.arguments import as_tolerance
from impactjax._hybrid.ends import as_start, with_arrays
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.section import section
from impactjax._hybrid.surface import Every
from impactjax._hybrid.system import HybridSystem, State
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._refusal import of_kind
from impactjax._response.parameter import Where, place_of, with_value
from impactjax._response.period import Force, Period, as_function
from impactjax._results import RESULTS
from impactjax._simulate.arguments import check_start
from impactjax._simulate.default_step import natural_step
from impactjax._simulate.lane_state import LaneState, lane_state_at
from impactjax._simulate.simulate import simulate
from impactjax._simulate.step import AbstractStep
from impactjax._types import Code, Flag, Scalar

_ROWS = 64  # steps of an oscillator in one run, which the next one goes on
_MOST = 256  # runs in a period, after which a lane is given up
_TOGETHER = 20  # lanes: what they need together fits into the cache


class Counts(NamedTuple):
    """Numbers of periods that are kept, and left out before them."""

    keep: int
    skip: int


class Sampled(NamedTuple):
    """Stroboscopic states at one value.

    - `states`: states after each period of the force.
    - `following`: start at the next value.
    - `result`: result code.
    """

    states: State
    following: PyTree
    result: RESULTS


class AbstractSampler(eqx.Module):
    """A forced system as a function of one of its parameters."""

    @abc.abstractmethod
    def __call__(self, value: Scalar, start: PyTree) -> Sampled:
        """The states at one value."""

    @abc.abstractmethod
    def side_by_side(self, values: Float[Array, " values"], start: PyTree) -> Sampled:
        """The states at several values, from the same start."""


class SystemSampler(AbstractSampler):
    """A hybrid system and its section."""

    system: HybridSystem
    force: Force
    tolerance: ArrayLike | None
    step: AbstractMethod | None
    place: int = eqx.field(static=True)
    counts: Counts = eqx.field(static=True)

    def __call__(self, value: Scalar, start: PyTree) -> Sampled:
        system = with_value(self.system, self.place, value)
        found = section(
            system,
            start,
            Every(jnp.asarray(self.force(system), value.dtype), start.t),
            keep=self.counts.keep,
            skip=self.counts.skip,
            tolerance=self.tolerance,
            step=self.step,
        )
        good = found.result == RESULTS.successful
        ended = found.final.y, found.final.mode[0]
        y, mode = _chosen(good, ended, (start.y, start.mode))
        return Sampled(found.after, Start(start.t, y, mode), found.result)

    def side_by_side(self, values: Float[Array, " values"], start: PyTree) -> Sampled:
        return jax.vmap(lambda value: self(value, start))(values)


class _Reached(NamedTuple):
    """An oscillator on the way to the end of a period, and its position and velocity there."""

    state: LaneState
    result: RESULTS
    runs: Code
    position: Scalar
    velocity: Scalar


class OscillatorSampler(AbstractSampler):
    """An impact oscillator and `simulate`, which goes on from period to period."""

    model: ImpactOscillator
    force: Force
    tolerance: Scalar
    step: AbstractStep
    place: int = eqx.field(static=True)
    counts: Counts = eqx.field(static=True)

    def __call__(self, value: Scalar, start: PyTree) -> Sampled:
        model, (keep, skip) = with_value(self.model, self.place, value), self.counts
        period, unknown = jnp.asarray(self.force(model), value.dtype), jnp.full_like(value, jnp.nan)

        def to_end(before: _Reached, number: Scalar) -> tuple[_Reached, tuple[Scalar, Scalar]]:
            """Runs the motion to the end of a period, if it has not failed before."""
            good = before.result == RESULTS.successful
            waits = RESULTS.where(good, RESULTS.max_steps_reached, before.result)
            reached = jax.lax.while_loop(
                lambda now: (now.result == RESULTS.max_steps_reached) & (now.runs < most),
                lambda now: self._further(model, now, period * number),
                _Reached(before.state, waits, jnp.int32(0), unknown, unknown),
            )
            return reached, (reached.position, reached.velocity)

        most = min(_MOST * (skip + 1), np.iinfo(np.int32).max)
        begin = _Reached(start, RESULTS.successful, jnp.int32(0), unknown, unknown)
        numbers = jnp.arange(skip + 1, skip + keep + 1, dtype=value.dtype)
        reached, (x, v) = jax.lax.scan(to_end, begin, numbers)
        good = reached.result == RESULTS.successful
        ended = _earlier(reached.state, period * (skip + keep))
        return Sampled({"position": x, "velocity": v}, _chosen(good, ended, start), reached.result)

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

    def side_by_side(self, values: Float[Array, " values"], start: PyTree) -> Sampled:
        return jax.lax.map(lambda value: self(value, start), values, batch_size=_TOGETHER)


def _earlier(state: LaneState, time: Scalar) -> LaneState:
    """The same state at an earlier time."""
    point = state.point._replace(t=state.point.t - time)
    origin, begun = state.origin - time, state.begun - time
    return dataclasses.replace(state, point=point, origin=origin, begun=begun)


def system_sampler(
    system: object,
    start: object,
    period: Period,
    where: Where,
    counts: Counts,
    tolerance: ArrayLike | None,
    step: object,
) -> tuple[SystemSampler, Start]:
    """The sampler of a hybrid system, and its first start. Checks the kinds of the arguments."""
    own: HybridSystem = of_kind("system", HybridSystem, "Ball(gravity, restitution)")(system)
    first: Start = of_kind("start", Start, "Start(t=0.0, y=y0)")(start)
    method = of_kind("step", AbstractMethod, "Taylor()", optional=True)(step)
    dtype = jnp.result_type(float, *jax.tree.leaves(first.y))
    own = with_arrays(own, dtype)
    place, force = place_of(own, where), as_function(period, own)
    begun = as_start(Start(first.t, first.y, first.mode), dtype)
    return SystemSampler(own, force, tolerance, method, place, counts), begun


def oscillator_sampler(
    model: object,
    start: object,
    period: Period,
    where: Where,
    counts: Counts,
    tolerance: ArrayLike | None,
    step: object,
) -> tuple[OscillatorSampler, LaneState]:
    """The sampler of an impact oscillator, and its first start, at time 0. Checks the kinds of the
    arguments.
    """
    own: ImpactOscillator = of_kind("model", ImpactOscillator, "ImpactOscillator(Pendulum(13.0))")(
        model
    )
    first: InitialState = of_kind("start", InitialState, "InitialState(0.3)")(start)
    method = of_kind("step", AbstractStep, "TaylorStep()", optional=True)(step)
    check_start(own, first, np.zeros(1), None)
    dtype = jnp.result_type(float, *jax.tree.leaves((own, first)))
    place, force = place_of(own, where), as_function(period, own)
    allowed = as_tolerance(tolerance, dtype)
    method = natural_step(own, allowed) if method is None else method
    begun = lane_state_at(method, own, jnp.zeros((), dtype), first)
    return OscillatorSampler(own, force, jnp.asarray(allowed, dtype), method, place, counts), begun


def _chosen(good: Flag, yes: PyTree, no: PyTree) -> PyTree:
    return jax.tree.map(lambda new, old: jnp.where(good, new, old), yes, no)
