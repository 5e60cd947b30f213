"""Stroboscopic states of forced motions."""

import abc
import dataclasses
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, PyTree

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
from impactjax._response.period import Force, Period, as_function
from impactjax._results import RESULTS
from impactjax._simulate.arguments import check_start
from impactjax._simulate.default_step import natural_step
from impactjax._simulate.lane_state import LaneState, lane_state_at
from impactjax._simulate.simulate import simulate
from impactjax._simulate.step import AbstractStep
from impactjax._types import Code, Flag, Scalar

System = TypeVar("System", bound=eqx.Module)

_ROWS = 64  # steps of an oscillator in one run, which the next one goes on
_MOST = 256  # runs in a period, after which a lane is given up
_TOGETHER = 20  # lanes: what they need together fits into the cache


class Counts(NamedTuple):
    """Numbers of periods that are kept, and left out before them."""

    keep: int
    skip: int


class Sampled(NamedTuple):
    """Stroboscopic states of a motion.

    - `states`: states after each period of the force.
    - `following`: start of a motion that goes on from there.
    - `result`: result code.
    """

    states: State
    following: PyTree
    result: RESULTS


class AbstractSampler(eqx.Module, Generic[System]):
    """Forced systems of one kind, which run from period to period."""

    @abc.abstractmethod
    def begun(self, system: System, start: PyTree) -> PyTree:
        """The start of a motion, as a call takes it."""

    @abc.abstractmethod
    def __call__(self, system: System, begun: PyTree) -> Sampled:
        """The states of one motion."""

    @abc.abstractmethod
    def side_by_side(self, motion: Callable[[PyTree], Sampled], lanes: PyTree) -> Sampled:
        """The states of a motion for each lane."""


class SystemSampler(AbstractSampler[HybridSystem]):
    """Hybrid systems and their sections."""

    force: Force
    tolerance: ArrayLike | None
    step: AbstractMethod | None
    counts: Counts = eqx.field(static=True)

    def begun(self, system: HybridSystem, start: Start) -> Start:
        del system
        start = Start(start.t, start.y, start.mode)  # what it remembers is of another value
        return as_start(start, jnp.result_type(float, *jax.tree.leaves(start.y)))

    def __call__(self, system: HybridSystem, begun: Start) -> Sampled:
        first = jnp.asarray(begun.t)
        found = section(
            system,
            begun,
            Every(jnp.asarray(self.force(system), first.dtype), first),
            keep=self.counts.keep,
            skip=self.counts.skip,
            tolerance=self.tolerance,
            step=self.step,
        )
        good = found.result == RESULTS.successful
        ended = found.final.y, found.final.mode[0]
        y, mode = _chosen(good, ended, (begun.y, begun.mode))
        return Sampled(found.after, Start(begun.t, y, mode), found.result)

    def side_by_side(self, motion: Callable[[PyTree], Sampled], lanes: PyTree) -> Sampled:
        return jax.vmap(motion)(lanes)


class _Reached(NamedTuple):
    """An oscillator on the way to the end of a period, and its position and velocity there."""

    state: LaneState
    result: RESULTS
    runs: Code
    position: Scalar
    velocity: Scalar


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
        dtype = self.tolerance.dtype
        period, unknown = jnp.asarray(self.force(system), dtype), jnp.array(jnp.nan, dtype)

        def to_end(before: _Reached, number: Scalar) -> tuple[_Reached, tuple[Scalar, Scalar]]:
            """Runs the motion to the end of a period, if it has not failed before."""
            good = before.result == RESULTS.successful
            waits = RESULTS.where(good, RESULTS.max_steps_reached, before.result)
            reached = jax.lax.while_loop(
                lambda now: (now.result == RESULTS.max_steps_reached) & (now.runs < most),
                lambda now: self._further(system, now, period * number),
                _Reached(before.state, waits, jnp.int32(0), unknown, unknown),
            )
            return reached, (reached.position, reached.velocity)

        most = min(_MOST * (skip + 1), np.iinfo(np.int32).max)
        begin = _Reached(begun, RESULTS.successful, jnp.int32(0), unknown, unknown)
        numbers = jnp.arange(skip + 1, skip + keep + 1, dtype=dtype)
        reached, (x, v) = jax.lax.scan(to_end, begin, numbers)
        good = reached.result == RESULTS.successful
        ended = _earlier(reached.state, period * (skip + keep))
        return Sampled({"position": x, "velocity": v}, _chosen(good, ended, begun), reached.result)

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

    def side_by_side(self, motion: Callable[[PyTree], Sampled], lanes: PyTree) -> Sampled:
        return jax.lax.map(motion, lanes, batch_size=_TOGETHER)


def _earlier(state: LaneState, time: Scalar) -> LaneState:
    """The same state at an earlier time."""
    point = state.point._replace(t=state.point.t - time)
    origin, begun = state.origin - time, state.begun - time
    return dataclasses.replace(state, point=point, origin=origin, begun=begun)


class Forced(NamedTuple):
    """A system of arrays, the start of a motion, and their sampler."""

    system: eqx.Module
    start: Start | InitialState
    run: AbstractSampler[Any]  # of systems of this kind


def forced(
    system: object,
    start: object,
    period: Period,
    counts: Counts,
    tolerance: ArrayLike | None,
    step: object,
) -> Forced:
    """A forced system and its sampler. Checks the kinds of the arguments."""
    if isinstance(system, ImpactOscillator):
        return _forced_oscillator(system, start, period, counts, tolerance, step)
    own: HybridSystem = of_kind("system", HybridSystem, "Ball(gravity, restitution)")(system)
    first: Start = of_kind("start", Start, "Start(t=0.0, y=y0)")(start)
    method = of_kind("step", AbstractMethod, "Taylor()", optional=True)(step)
    own = with_arrays(own, jnp.result_type(float, *jax.tree.leaves(first.y)))
    return Forced(own, first, SystemSampler(as_function(period, own), tolerance, method, counts))


def _forced_oscillator(
    model: ImpactOscillator,
    start: object,
    period: Period,
    counts: Counts,
    tolerance: ArrayLike | None,
    step: object,
) -> Forced:
    first: InitialState = of_kind("start", InitialState, "InitialState(0.3)")(start)
    method = of_kind("step", AbstractStep, "TaylorStep()", optional=True)(step)
    check_start(model, first, np.zeros(1), None)
    leaves = (jnp.zeros(()), *jax.tree.leaves((model, first)))  # swept values are as the first
    dtype = np.result_type(*(jnp.result_type(leaf) for leaf in leaves))
    first = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), first)
    allowed = as_tolerance(tolerance, dtype)
    method = natural_step(model, allowed) if method is None else method
    force = as_function(period, model)
    run = OscillatorSampler(force, jnp.asarray(allowed, dtype), method, counts)
    return Forced(model, first, run)


def _chosen(good: Flag, yes: PyTree, no: PyTree) -> PyTree:
    return jax.tree.map(lambda new, old: jnp.where(good, new, old), yes, no)
