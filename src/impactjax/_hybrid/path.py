"""The logged steps as a smooth function of system, start and time.

The adaptive loop cannot be differentiated, but its log can. Each step is a smooth map of known
duration, or of a duration that is an implicit function of its start, by the event at its end. Event
times have their own derivatives, so the jump is simply applied to state and time; the result is the
saltation matrix. The tangents are computed with the same functions as the values, so that
derivatives of any order are exact.
"""

from functools import partial
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, PyTree

from impactjax._hybrid.chunks import FEW_STEPS, map_rows, scan_rows
from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.lane import Log, Record
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.system import State
from impactjax._types import Scalar

_Carry: TypeAlias = tuple[Scalar, State]  # tangents of the next start: time and state


class Path(NamedTuple):
    """The steps of a lane with derivatives, one row for each pass, and the start after them.

    - `next_t`, `next_y`: start of the step that follows each one.
    """

    t: Array
    y: State
    h: Array
    end: State
    next_t: Array
    next_y: State
    expansion: PyTree


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def differentiable_path(
    step: AbstractFlowStep,
    fixed: Equations,
    variable: Equations,
    t0: Scalar,
    y0: State,
    record: Record,
) -> Path:
    """The logged steps of a lane, differentiable with respect to `variable`, `t0` and `y0`.

    `variable` holds the arrays of the equations, and `fixed` all the rest.
    """
    del t0, y0
    log, equations = record.log, eqx.combine(variable, fixed)
    expansions = map_rows(
        lambda row: step.expand(equations, row.t, row.y, row.mode, row.unit),
        log,
        record.passes,
        FEW_STEPS,
    )
    return Path(log.t, log.y, log.h, log.end, log.next_t, log.next_y, expansions)


@partial(differentiable_path.defjvp, symbolic_zeros=True)
def _(
    step: AbstractFlowStep,
    fixed: Equations,
    primals: tuple[PyTree, ...],
    tangents: tuple[PyTree, ...],
) -> tuple[Path, Path]:
    variable, t0, y0, record = primals
    d_variable, d_t0, d_y0, _ = tangents
    values = differentiable_path(step, fixed, *primals)
    varies = jax.tree.map(lambda tangent: not isinstance(tangent, SymbolicZero), d_variable)
    varied, constant = eqx.partition(variable, varies)
    rest = eqx.combine(constant, fixed)
    d_varied = eqx.filter(d_variable, varies)

    def body(carry: _Carry, row: tuple[Path, Log]) -> tuple[_Carry, Path]:
        return _push_forward(step, rest, varied, d_varied, carry, *row)

    start = jax.tree.map(or_zeros, (d_t0, d_y0), (t0, y0))
    _, d_values = scan_rows(body, start, (values, record.log), record.passes)
    return values, d_values


def or_zeros(tangent: Array | SymbolicZero, value: Array) -> Array:
    """A tangent, with its zeros as numbers."""
    return jnp.zeros_like(value) if isinstance(tangent, SymbolicZero) else tangent


def _push_forward(
    step: AbstractFlowStep,
    rest: Equations,
    varied: Equations,
    d_varied: Equations,
    carry: _Carry,
    values: Path,
    log: Log,
) -> tuple[_Carry, Path]:
    """Tangents of one step: of its start, its duration, its end, and of the next start.

    With the start (t, y), the duration h, the end x(h; t, y, p) and the parameters p:

    - duration: dh = −dg/ġ for an event with the guard g(t + h, x) = 0. dg is the change of g at
      fixed h, and ġ its rate along the flow. Otherwise dh = 0, also for an event that the jump
      before has caused.
    - end: dx = (∂x/∂p) dp + (∂x/∂t) dt + (∂x/∂y) dy + ẋ dh
    - next start: by the jump from (t + h, x)
    """
    d_t, d_y = carry
    t, y, h, end, _, _, expansion = values
    mode, event = log.mode, log.event
    happens = event != NO_EVENT

    def expanded(varied: Equations, t: Scalar, y: State) -> PyTree:
        return step.expand(eqx.combine(varied, rest), t, y, mode, log.unit)

    def flowed(varied: Equations, y: State, expansion: PyTree, h: Scalar) -> State:
        own = eqx.combine(varied, rest)
        return step.evaluate(own, y, mode, expansion, h, jnp.zeros_like(h))

    def guard(varied: Equations, t: Scalar, end: State) -> Scalar:
        own = jnp.zeros_like(t)
        for number, value in enumerate(eqx.combine(varied, rest).guards(t, end, mode)):
            own = jnp.where(event == number, value, own)
        return own

    def followed(varied: Equations, t: Scalar, y: State, h: Scalar, end: State) -> _Carry:
        return _next(eqx.combine(varied, rest), log, t, y, h, end)

    _, d_expansion = jax.jvp(expanded, (varied, t, y), (d_varied, d_t, d_y))
    still_varied, still_y = jax.tree.map(jnp.zeros_like, (varied, y))
    still_expansion = jax.tree.map(jnp.zeros_like, expansion)
    one, zero = jnp.ones_like(h), jnp.zeros_like(h)
    place = varied, y, expansion, h
    _, d_end = jax.jvp(flowed, place, (d_varied, d_y, d_expansion, zero))
    _, rate = jax.jvp(flowed, place, (still_varied, still_y, still_expansion, one))
    arrival = varied, t + h, end
    _, d_guard = jax.jvp(guard, arrival, (d_varied, d_t, d_end))
    _, fall = jax.jvp(guard, arrival, (still_varied, one, rate))
    falls = happens & ~log.caused & (fall != 0)
    d_h = jnp.where(falls, -d_guard / jnp.where(falls, fall, 1.0), 0.0)
    _, d_end = jax.jvp(flowed, place, (d_varied, d_y, d_expansion, d_h))
    _, d_next = jax.jvp(followed, (varied, t, y, h, end), (d_varied, d_t, d_y, d_h, d_end))
    moved = jax.tree.map(lambda new, old: jnp.where(log.taken, new, old), d_next, carry)
    return moved, Path(d_t, d_y, d_h, d_end, d_next[0], d_next[1], d_expansion)


def _next(
    equations: Equations, log: Log, t: Scalar, y: State, h: Scalar, end: State
) -> tuple[Scalar, State]:
    """Time and state at the start of the next step; the same start after the last step."""
    jump = equations.jump(log.event, t + h, end, log.mode)
    after = t + h + jump.wait, jump.y
    return jax.tree.map(lambda new, old: jnp.where(log.last, old, new), after, (t, y))
