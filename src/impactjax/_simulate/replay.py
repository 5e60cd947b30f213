"""The logged steps as a smooth function of model, initial state, start and end.

The adaptive loop cannot be differentiated, but its log can. Each step is a smooth map of known
duration, or of a duration that is an implicit function of its start, by the event at its end. Event
times have their own derivatives, so the jump map is simply applied to state and time; the result is
the saltation matrix. The tangents are computed with the same functions as the values, so that
derivatives of any order are exact.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float, PyTree

from impactjax._hybrid.chunks import FEW_STEPS, map_rows, scan_rows
from impactjax._hybrid.path import or_zeros
from impactjax._hybrid.varying import alike
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.chatter import Chatter, Scale
from impactjax._simulate.lane import Log, Record, Whole, factors_of
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.transition import Context
from impactjax._types import Code, Factors, Flag, Scalar

_Factor: TypeAlias = tuple[Scalar, Scalar] | None  # factor on a speed, and its tangent
_PerStep: TypeAlias = Float[Array, " steps"]
_Start: TypeAlias = tuple[Scalar, State]  # of the next step: time and state, or their tangents


class Path(NamedTuple):
    """The steps of a lane with derivatives, one row for each pass, up to the end of the run."""

    t: Array
    y: State
    h: Array
    end: State
    expansion: PyTree


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def differentiable_path(
    step: AbstractStep,
    model: ImpactOscillator,
    y0: State,
    t0: Scalar,
    t1: Scalar,
    factors: Factors | None,
    record: Record,
) -> tuple[Path, _Start]:
    """The logged steps of a lane, and the start of a later run, differentiable with respect to
    `model`, `y0`, `t0`, `t1` and the factors.
    """
    del y0, t0, t1, factors
    log = record.log
    automaton = Automaton(model)
    expansions = map_rows(
        lambda row: step.expand(automaton, row[0].t, row[0].y, row[0].mode, *row[1]),
        (log, record.whole),
        record.passes,
        FEW_STEPS,
    )
    beyond = record.whole.h > log.h
    last = jnp.argmax(beyond)
    row, expansion = jax.tree.map(lambda column: column[last], (log, expansions))
    none = jnp.zeros_like(row.h)
    where = row.t, row.y, row.mode, expansion, row.h, none
    ended = state_within(step, automaton, record.chatters, *where)
    end = jax.tree.map(lambda a, b: jnp.where(beyond, a, b), ended, log.end)
    final = record.final.point
    return Path(log.t, log.y, log.h, end, expansions), (final.t, final.y)


@partial(differentiable_path.defjvp, symbolic_zeros=True)
def _(
    step: AbstractStep, primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]
) -> tuple[tuple[Path, _Start], tuple[Path, _Start]]:
    model, y0, t0, t1, factors, record = primals
    d_model, d_y0, d_t0, d_t1, d_factors, _ = tangents
    values, final = differentiable_path(step, *primals)
    varies = jax.tree.map(lambda tangent: not isinstance(tangent, SymbolicZero), d_model)
    varied, constants = eqx.partition(model, varies)
    d_varied = eqx.filter(d_model, varies)

    def automaton(varied: ImpactOscillator) -> Automaton:
        return Automaton(eqx.combine(varied, constants))

    def body(carry: _Start, row: tuple[Path, Log, Whole, _Factor]) -> tuple[_Start, Path]:
        return _push_forward(
            step, automaton, varied, d_varied, d_end, record.t1, record.chatters, carry, *row
        )

    *start, d_end = jax.tree.map(or_zeros, (d_t0, d_y0, d_t1), (t0, y0, t1))
    own = _factors_of_steps(Automaton(model), values, record.log, factors, d_factors)
    rows = values, record.log, record.whole, own
    d_final, d_values = scan_rows(body, tuple(start), rows, record.passes)
    return (values, final), (d_values, d_final)


def _factors_of_steps(
    automaton: Automaton,
    path: Path,
    log: Log,
    factors: Factors | None,
    d_factors: Factors | SymbolicZero | None,
) -> tuple[_PerStep, _PerStep] | None:
    """The factor that belongs to the end of each step, and its tangent; `None` without factors."""
    if factors is None or d_factors is None:
        return None
    d_factors = or_zeros(d_factors, factors)
    begins = jax.vmap(automaton.begins_impact)(log.event, path.t + path.h, path.end, log.mode)
    number = jnp.cumsum(begins & log.taken, dtype=jnp.int32) - 1
    return factors_of(factors, number), factors_of(d_factors, number, beyond=0.0)


def _push_forward(
    step: AbstractStep,
    automaton: Callable[[ImpactOscillator], Automaton],
    model: ImpactOscillator,
    d_model: ImpactOscillator,
    d_t1: Scalar,
    t1: Scalar,
    chatters: Flag,
    carry: _Start,
    values: Path,
    log: Log,
    whole: Whole,
    factor: _Factor,
) -> tuple[_Start, Path]:
    """Tangents of one step: of its start, its duration, its end, and of the next start.

    With the start (t, y), the duration h, the end x(h; t, y, p) and the parameters p:

    - duration: dh = −dg/ġ for an event with the guard g(t + h, x) = 0. dg is the change of g at
      fixed h, and ġ its rate along the flow. For the last step, which ends at t1, dh = dt1 − dt;
      otherwise dh = 0.
    - end: dx = (∂x/∂p) dp + (∂x/∂t) dt + (∂x/∂y) dy + ẋ dh
    - next start: dt⁺ = dt + dh, and dy⁺ = dJ by the jump y⁺ = J(p, t + h, x)

    Example: for a ball on a floor, with g = x, the first line is dh = −dx/v; together with the jump
    v⁺ = −r v the three give the saltation matrix of an impact.

    `model` holds the parameters that vary, and `automaton` completes it with the constants.
    """
    d_t, d_y = carry
    t, y, h, end, expansion = values
    mode, event = log.mode, log.event
    happens = event != NO_EVENT

    def expanded(model: ImpactOscillator, t: Scalar, y: State) -> PyTree:
        return step.expand(automaton(model), t, y, mode, *whole)

    def flowed(model: ImpactOscillator, expansion: PyTree, h: Scalar) -> State:
        return step.end(automaton(model), mode, expansion, h)

    def pushed(d_model: ImpactOscillator, d_expansion: PyTree, d_h: Scalar) -> State:
        return jax.jvp(flowed, (model, expansion, h), (d_model, d_expansion, d_h))[1]

    def reserve(model: ImpactOscillator, t: Scalar, y: State, h: Scalar, end: State) -> Scalar:
        """Function that is zero at the end of the step: the guard, or the time left of a summed
        chatter.
        """
        own = automaton(model)
        left = own.time_left(t, y, mode) - h
        guard = jnp.zeros_like(left)
        for index, value in enumerate(own.guards(t + h, end, mode)):
            guard = jnp.where(event == index, value, guard)
        return jnp.where(mode.phase == Phase.CHATTER, left, guard)

    def or_chatter(model: ImpactOscillator, t: Scalar, y: State, flowed: State) -> State:
        return _unless_chatter(automaton(model), chatters, t, y, mode, h, flowed)

    def jumped(model: ImpactOscillator, t: Scalar, end: State, factor: Scalar | None) -> State:
        return _jump(automaton(model), event, t, end, mode, factor)

    _, d_expansion = jax.jvp(expanded, (model, t, y), (d_model, d_t, d_y))
    place, in_time = (model, t, y, h, end), jnp.zeros_like(h)
    still = jax.tree.map(jnp.zeros_like, (model, t, y, expansion))
    d_end = pushed(d_model, d_expansion, in_time)
    rate = pushed(still[0], still[3], jnp.ones_like(h))
    _, d_reserve = jax.jvp(reserve, place, (d_model, d_t, d_y, in_time, d_end))
    _, fall = jax.jvp(reserve, place, (*still[:3], jnp.ones_like(h), rate))
    d_h = jnp.where(h >= t1 - t, d_t1 - d_t, 0.0)
    falls = happens & (fall != 0)  # no event, or one with a constant guard
    d_h = jnp.where(falls, -d_reserve / jnp.where(falls, fall, 1.0), d_h)
    # Not d_end + rate * d_h: the derivative of a force may be infinite or jump at the surface. Its
    # factor vanishes only in the sum of both terms.
    d_end = pushed(d_model, d_expansion, d_h)
    _, d_end = jax.jvp(or_chatter, (model, t, y, end), (d_model, d_t, d_y, d_end))
    own, d_own = (None, None) if factor is None else factor
    _, d_next = jax.jvp(jumped, (model, t + h, end, own), (d_model, d_t + d_h, d_end, d_own))

    moves = log.taken & ~(whole.h > h)  # a later run takes the last step again
    moved = jax.tree.map(lambda new, old: jnp.where(moves, new, old), (d_t + d_h, d_next), carry)
    return moved, Path(d_t, d_y, d_h, d_end, d_expansion)


def _jump(
    automaton: Automaton, event: Code, t: Scalar, end: State, mode: Mode, factor: Scalar | None
) -> State:
    """The state after an event."""
    unused = jnp.zeros_like(t)
    context = Context(Scale(unused, unused), unused, Chatter())
    after = automaton.jump(event, t, end, mode, context).state
    return after if factor is None else automaton.scattered(event, t, end, mode, after, factor)


def state_within(
    step: AbstractStep,
    automaton: Automaton,
    chatters: Flag,
    t: Scalar,
    y: State,
    mode: Mode,
    expansion: PyTree,
    s: Scalar,
    delay: Scalar,
) -> State:
    """The state at the time `s − delay` after the start of an expanded step. The delay is zero and
    has derivatives only.

    `chatters` is true if any step of the batch may be a summed chatter.
    """
    flowed = step.evaluate(automaton, mode, expansion, s, delay)
    return _unless_chatter(automaton, chatters, t, y, mode, s - delay, flowed)


def _unless_chatter(
    automaton: Automaton, chatters: Flag, t: Scalar, y: State, mode: Mode, s: Scalar, flowed: State
) -> State:
    if not automaton.rigid_stops():
        return flowed
    place = automaton, t, y, mode, s, flowed
    return jax.lax.cond(
        chatters,
        lambda flowed: alike(automaton.with_chatter(t, y, mode, s, flowed), place),
        lambda flowed: alike(flowed, place),
        flowed,
    )
