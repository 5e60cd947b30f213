"""A step by an explicit Runge-Kutta method of Diffrax, for any flow."""

import math
from typing import TYPE_CHECKING, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.lane import Point
from impactjax._hybrid.numbers import direction, packed, time_scale, unpacked
from impactjax._hybrid.step import AbstractFlowStep, Attempt
from impactjax._hybrid.system import Mode, State
from impactjax._hybrid.watch import Armed, arm, cleaned, until_return, watch
from impactjax._series.crossing import shortened
from impactjax._series.quintic import quintic
from impactjax._types import Code, Scalar

if TYPE_CHECKING:
    import diffrax

_SAFETY = 0.9  # safety factor of the next step
_SHRINK, _GROW = 0.2, 10.0  # limits of the ratio of successive steps
_RESOLUTION = 1e-8  # of an event close to grazing, as a fraction of the first guess
_LOCAL = 0.5  # local error asked for, as a fraction of the tolerance
_LANDED = math.sqrt(np.finfo(float).eps)  # distance to the event, as a fraction of the step

_Numbers = Float[Array, " numbers"]


class _Memory(NamedTuple):
    h: Scalar  # to try; zero asks for a first guess
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
        del equations, y, mode
        return _Memory(jnp.zeros_like(t), jnp.int32(NO_EVENT))

    def attempt(
        self, equations: Equations, start: Point, tolerance: Scalar, scale: State
    ) -> Attempt:
        t, y, mode, memory = start
        order = self._order()
        guess = (_LOCAL * tolerance) ** (1 / order) * time_scale(equations, t, y, mode)
        h = jnp.where(memory.step.h > 0, memory.step.h, guess)
        end, ratio = self._with_error(equations, start, h, scale)
        armed, returns, margin = _guards(equations, start, end, h, tolerance)
        ratio = ratio / (_LOCAL * tolerance)
        defined = jnp.all(jnp.isfinite(jnp.stack(armed.series))) & ~jnp.isnan(ratio)
        ratio = jnp.where(defined, ratio, jnp.inf)  # otherwise the step is much too long
        accurate = ratio <= 1
        factor = jnp.clip(_SAFETY * jnp.maximum(ratio, 1e-30) ** (-1 / order), _SHRINK, _GROW)

        settle = h <= _RESOLUTION * guess
        found = watch(armed, settle, margin, memory.step.target)
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
        following = jnp.where(landed | at_once, guess, jnp.where(plain, h * factor, retry))
        lands = wanted & ends & ~accepted
        after = _Memory(following, jnp.where(lands, found.guard, NO_EVENT).astype(jnp.int32))
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
        self, equations: Equations, start: Point, h: Scalar, scale: State
    ) -> tuple[State, Scalar]:
        """The state after a step, and its largest relative error, also of a disturbance."""
        variable, fixed = eqx.partition(equations, eqx.is_inexact_array)

        def stepped(variable: Equations, y: State) -> tuple[_Numbers, _Numbers, _Numbers]:
            own = eqx.combine(variable, fixed)
            return _stepped(self.solver, own, start.t, y, start.mode, h)

        place = variable, start.y
        along = direction(place)
        values, changes = jax.jvp(stepped, place, along)
        still = [packed(start.y), packed(along[1])]
        floors = [packed(scale), jnp.zeros_like(still[0])]
        ratios = []
        for (end, error, way), begin, floor in zip((values, changes), still, floors, strict=True):
            size = jnp.maximum(jnp.maximum(jnp.abs(begin), jnp.abs(end)), jnp.abs(way))
            size = jnp.maximum(size, floor) + jnp.finfo(h.dtype).tiny
            ratios.append(jnp.max(jnp.abs(error) / size))
        return unpacked(values[0], start.y), jnp.maximum(*ratios)


def _guards(
    equations: Equations, start: Point, end: State, h: Scalar, tolerance: Scalar
) -> tuple[Armed, Scalar, Float[Array, " guards"]]:
    """The guards of a step, the share of it that their expected return allows, and their error."""
    if not equations.count():
        nothing = jnp.zeros(0, h.dtype)
        armed = Armed([nothing] * 6, start.memory.armed, start.memory.armed)
        return armed, jnp.full_like(h, jnp.inf), nothing
    before = _jet(equations, start.t, start.y, start.mode)
    after = _jet(equations, start.t + h, end, start.mode)
    coefficients, margin = quintic(before, after, h)
    sway, usual = _sway(equations, start), jnp.ones_like(h)
    series = cleaned(coefficients, sway, usual, start.memory, tolerance)
    return arm(series, start.memory, tolerance), until_return(series), margin


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

    def value(t: Scalar, y: State) -> Array:
        return equations.guard_values(t, y, mode)

    def slope(t: Scalar, y: State) -> Array:
        return jax.jvp(value, (t, y), (jnp.ones_like(t), equations.flow(t, y, mode)))[1]

    rate = equations.flow(t, y, mode)
    first, second = jax.jvp(slope, (t, y), (jnp.ones_like(t), rate))
    return value(t, y), first, second


@eqx.filter_jit  # so that it is traced once, for attempts, samples and derivatives alike
def _stepped(
    solver: "diffrax.AbstractERK", equations: Equations, t: Scalar, y: State, mode: Mode, h: Scalar
) -> tuple[_Numbers, _Numbers, _Numbers]:
    """The state after `h`, its estimated error, and the way h y′ of the first stage."""

    @jax.jit  # so that it is traced once, not stage by stage
    def rates(t: Scalar, numbers: _Numbers) -> _Numbers:
        return packed(equations.flow(t, unpacked(numbers, y), mode))

    tableau, begin = cast("diffrax.ButcherTableau", solver.tableau), packed(y)
    stages = [rates(t, begin)]
    for c, row in zip(map(float, tableau.c), tableau.a_lower, strict=True):
        stages.append(rates(t + c * h, begin + h * _weighted(row, stages)))
    end = begin + h * _weighted(tableau.b_sol, stages)
    return end, h * _weighted(tableau.b_error, stages), h * stages[0]


def _weighted(weights: np.ndarray, stages: list[_Numbers]) -> _Numbers:
    used = [(float(w), stage) for w, stage in zip(weights, stages, strict=False) if w != 0]
    return sum((w * stage for w, stage in used), jnp.zeros_like(stages[0]))
