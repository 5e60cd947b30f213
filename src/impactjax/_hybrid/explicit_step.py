"""A step by an explicit Runge-Kutta method of Diffrax, for any flow."""

import math
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._hybrid.butcher import Stage, butcher
from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.lane import Point
from impactjax._hybrid.numbers import direction, packed, time_scale, unpacked
from impactjax._hybrid.step import AbstractFlowStep, Attempt
from impactjax._hybrid.system import Mode, State
from impactjax._hybrid.varying import alike
from impactjax._hybrid.watch import Armed, arm, cleaned, until_return, watch
from impactjax._series.crossing import shortened
from impactjax._series.polynomial import horner
from impactjax._series.quintic import quintic
from impactjax._types import Code, Flag, Scalar

if TYPE_CHECKING:
    import diffrax

_SAFETY = 0.9  # safety factor of the next step
_SHRINK, _GROW = 0.2, 10.0  # limits of the ratio of successive steps
_FIRST = 0.1  # the first step to try, in units of the time in which the state changes
_RESOLUTION = 1e-8  # of an event close to grazing, as a fraction of the natural step
_LOCAL = 0.5  # local error asked for, as a fraction of the tolerance
_INSIDE = (0.31, 0.62)  # shares of a step at which guards are checked
_SEEN = 0.1  # error of a guard there, relative to its size
_ROUNDING = 64.0  # units in the last place of the terms of a rate
_LANDED = math.sqrt(np.finfo(float).eps)  # distance to the event, as a fraction of the step

_Numbers = Float[Array, " numbers"]


class _Memory(NamedTuple):
    h: Scalar  # to try
    natural: Scalar  # about the longest accurate one
    target: Code  # the guard being landed on, or NO_EVENT


class _Expansion(NamedTuple):
    """Start of a step; samples within it are computed as separate steps from there."""

    t: Scalar
    y: State


class ExplicitStep(AbstractFlowStep):
    """A step by an explicit Runge-Kutta method.

    A step that ends beyond an event is repeated with a shorter duration until it ends on the event.
    Inside the step, guards are checked through their quintic Hermite polynomials. The error of a
    small disturbance of state and parameters in a fixed general direction counts as well.

    - `solver`: its Butcher tableau is used.
    """

    solver: "diffrax.AbstractERK" = eqx.field(static=True)

    def begin(self, equations: Equations, t: Scalar, y: State, mode: Mode) -> _Memory:
        first = _FIRST * time_scale(lambda t, y: equations.flow(t, y, mode), t, y)
        return _Memory(first, first, jnp.int32(NO_EVENT))

    def attempt(
        self, equations: Equations, start: Point, tolerance: Scalar, scale: State
    ) -> Attempt:
        t, y, mode, memory = start
        order = self._order()
        h, natural, target = memory.step
        h = jnp.minimum(h, equations.smooth_for(t, mode))
        end, ratio = self._with_error(equations, start, h, scale, tolerance)
        armed, returns, margin, coarse = _guards(equations, start, end, h, tolerance)
        ratio = ratio / (_LOCAL * tolerance)
        defined = jnp.all(jnp.isfinite(jnp.stack(armed.series))) & ~jnp.isnan(ratio)
        ratio = jnp.where(defined, ratio, jnp.inf)  # otherwise the step is much too long
        accurate = (ratio <= 1) & ~coarse
        factor = jnp.clip(_SAFETY * jnp.maximum(ratio, 1e-30) ** (-1 / order), _SHRINK, _GROW)
        factor = jnp.where(coarse, jnp.minimum(factor, 0.5), factor)

        settle = h <= _RESOLUTION * natural
        found = watch(armed, settle, margin, target)
        wanted = accurate & (returns >= 1) & ~found.unclear
        ends = found.fraction <= 1 + _LANDED
        landed = wanted & ends & (found.fraction >= 1 - _LANDED)
        at_once = wanted & (t + found.fraction * h == t)
        plain = wanted & ~ends
        accepted = landed | at_once | plain

        correction = jnp.where(landed, (found.fraction - 1) * h, 0.0)
        rate = equations.flow(t + h, end, mode)
        end = jax.tree.map(lambda y, dy: y + dy * correction, end, rate)
        end = jax.tree.map(lambda y0, y1: jnp.where(at_once, y0, y1), y, end)
        taken = jnp.where(at_once, 0.0, h + correction)
        retry = jnp.where(wanted & ends, found.fraction * h, h * jnp.minimum(factor, 1.0))
        retry = jnp.where(accurate & (returns < 1), returns * h, retry)
        shorter = shortened(h, found.fraction, t)
        retry = jnp.where(accurate & (returns >= 1) & found.unclear, shorter, retry)
        following = jnp.where(landed | at_once, natural, jnp.where(plain, h * factor, retry))
        lands = wanted & ends & ~accepted
        longest = jnp.where(plain, h * factor, jnp.where(accurate, natural, retry))
        next_target = jnp.where(lands, found.guard, NO_EVENT).astype(jnp.int32)
        after = _Memory(following, longest, next_target)
        again = ~accepted & (t + following > t)  # a step too long may overflow
        end = jax.tree.map(lambda y0, y1: jnp.where(again, y0, y1), y, end)
        event = jnp.where(plain, NO_EVENT, found.event)
        still_armed = jnp.where(plain, armed.armed, found.armed)
        return Attempt(accepted, taken, taken, end, event, found.caused, still_armed, after)

    def expand(
        self, equations: Equations, t: Scalar, y: State, mode: Mode, unit: Scalar
    ) -> _Expansion:
        del equations, mode, unit
        return _Expansion(t, y)

    def evaluate(
        self,
        equations: Equations,
        like: State,
        mode: Mode,
        expansion: _Expansion,
        s: Scalar,
        delay: Scalar,
    ) -> State:
        end, _, _ = _stepped(self.solver, equations, expansion.t, expansion.y, mode, s - delay)
        return unpacked(end, like)

    def _order(self) -> int:
        order = self.solver.order(None)  # pyright: ignore[reportArgumentType]  terms do not matter
        assert order is not None
        return order

    def _with_error(
        self, equations: Equations, start: Point, h: Scalar, scale: State, tolerance: Scalar
    ) -> tuple[State, Scalar]:
        """The state after a step, and its largest relative error, also of a disturbance.

        A number whose rate is a difference of larger terms is known only to their rounding. The
        disturbance tells their size.
        """
        variable, fixed = eqx.partition(equations, eqx.is_inexact_array)

        def stepped(variable: Equations, y: State) -> tuple[_Numbers, _Numbers, _Numbers]:
            own = eqx.combine(variable, fixed)
            return _stepped(self.solver, own, start.t, y, start.mode, h)

        place = variable, start.y
        along = direction(place)
        values, changes = jax.jvp(stepped, place, along)
        still = [packed(start.y), packed(along[1])]
        moved = jnp.maximum(jnp.abs(changes[2]), jnp.abs(changes[0] - still[1]))
        rounding = _ROUNDING * np.finfo(h.dtype).eps / tolerance * moved
        floors = [jnp.maximum(packed(scale), rounding), rounding]
        ratios = []
        for (end, error, way), begin, floor in zip((values, changes), still, floors, strict=True):
            size = jnp.maximum(jnp.maximum(jnp.abs(begin), jnp.abs(end)), jnp.abs(way))
            size = jnp.maximum(size, floor) + jnp.finfo(h.dtype).tiny
            ratios.append(jnp.max(jnp.abs(error) / size))
        return unpacked(values[0], start.y), jnp.maximum(*ratios)


def _guards(
    equations: Equations, start: Point, end: State, h: Scalar, tolerance: Scalar
) -> tuple[Armed, Scalar, Float[Array, " guards"], Flag]:
    """The guards of a step, the share of it that their expected return allows, their error, and
    true if the step is too coarse for them: the flow need not show how a guard changes.
    """
    if not equations.count():
        nothing = jnp.zeros(0, h.dtype)
        armed = Armed([nothing] * 6, start.memory.armed, start.memory.armed)
        return armed, jnp.full_like(h, jnp.inf), nothing, jnp.zeros((), bool)
    before = _jet(equations, start.t, start.y, start.mode)
    after = _jet(equations, start.t + h, end, start.mode)
    coefficients, margin = quintic(before, after, h)
    sway, usual = _sway(equations, start), jnp.ones_like(h)
    series = cleaned(coefficients, sway, usual, start.memory, tolerance)
    ends = jnp.stack([before[0], after[0], h * before[1], h * after[1]])
    coarse = _differs(equations, start, end, h, coefficients, ends)
    return arm(series, start.memory, tolerance), until_return(series), margin, coarse


def _differs(
    equations: Equations,
    start: Point,
    end: State,
    h: Scalar,
    coefficients: list[Float[Array, " guards"]],
    ends: Float[Array, "four guards"],
) -> Flag:
    """True if guards inside the step differ from their quintics."""
    t, y, mode, _ = start
    rates = equations.flow(t, y, mode), equations.flow(t + h, end, mode)

    def inside(w: float) -> State:
        """The state at a share of the step, by the cubic through both ends."""
        a, b = (1 + 2 * w) * (1 - w) ** 2, w**2 * (3 - 2 * w)
        c, d = w * (1 - w) ** 2, w**2 * (w - 1)
        return jax.tree.map(
            lambda y0, y1, f0, f1: a * y0 + b * y1 + h * (c * f0 + d * f1), y, end, *rates
        )

    found = jnp.zeros((), bool)
    for w in _INSIDE:
        value = equations.guard_values(t + w * h, inside(w), mode)
        expected = horner(coefficients, jnp.asarray(w, h.dtype))
        size = jnp.max(jnp.abs(jnp.stack([*ends, value])), axis=0)
        found = found | jnp.any(jnp.abs(value - expected) > _SEEN * size)
    return found


def _sway(equations: Equations, start: Point) -> Float[Array, " guards"]:
    """The change of the guards by a disturbance of state and parameters."""
    variable, fixed = eqx.partition(equations, eqx.is_inexact_array)
    place = variable, start.y
    _, change = jax.jvp(
        lambda own, y: eqx.combine(own, fixed).guard_values(start.t, y, start.mode),
        place,
        direction(place),
    )
    return change


def _jet(equations: Equations, t: Scalar, y: State, mode: Mode) -> tuple[Array, Array, Array]:
    """Guards with their first and second derivative in time along the flow."""

    def slope(t: Scalar, y: State) -> tuple[Array, Array]:
        along = jnp.ones_like(t), equations.flow(t, y, mode)
        return jax.jvp(lambda t, y: equations.guard_values(t, y, mode), (t, y), along)

    along = jnp.ones_like(t), equations.flow(t, y, mode)
    (value, first), (_, second) = jax.jvp(slope, (t, y), along)
    return value, first, second


@eqx.filter_jit  # so that it is traced once, for attempts, samples and derivatives alike
def _stepped(
    solver: "diffrax.AbstractERK", equations: Equations, t: Scalar, y: State, mode: Mode, h: Scalar
) -> tuple[_Numbers, _Numbers, _Numbers]:
    """The state after `h`, its estimated error, and the way h y′ of the first stage.

    The stages are passes of one loop, so that the program does not grow with their number.
    """
    tableau, begin = butcher(solver, h.dtype), packed(y)

    def stage(rates: Array, row: Stage) -> tuple[Array, None]:
        moved = unpacked(begin + h * (row.weights @ rates), y)
        rate = packed(equations.flow(t + row.node * h, moved, mode))
        return jnp.where(tableau.stages.number[:, None] == row.number, rate, rates), None

    nothing = jnp.zeros((tableau.end.size, begin.size), h.dtype)
    nothing = alike(nothing, (equations, t, y, mode, h))
    rates, _ = jax.lax.scan(stage, nothing, tableau.stages)
    return begin + h * (tableau.end @ rates), h * (tableau.error @ rates), h * rates[0]
