"""A step by the Taylor series of the solution of any flow."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._hybrid.equations import NO_EVENT, Equations
from impactjax._hybrid.lane import Point
from impactjax._hybrid.numbers import direction, packed, time_scale, unpacked
from impactjax._hybrid.step import AbstractFlowStep, Attempt
from impactjax._hybrid.system import Mode, State
from impactjax._hybrid.watch import arm, cleaned, until_return, watch
from impactjax._series.accuracy import longest_accurate
from impactjax._series.crossing import shortened
from impactjax._series.polynomial import polynomial, rescaled
from impactjax._series.recurrences.tables import AWAY_FROM_SINGULARITIES
from impactjax._series.taylor import solution_series
from impactjax._types import Scalar

_LONGEST = 100.0  # largest ratio of a step to the one before
_RESOLUTION = 1e-8  # of an event close to grazing, as a fraction of the planned step

Coefficients = Float[Array, "coefficients numbers"]


class _Memory(NamedTuple):
    unit: Scalar  # of time in the next series: about the length of a step
    cap: Scalar  # the next step is at most as long as this


class _Expansion(NamedTuple):
    coefficients: Coefficients  # of the whole state
    unit: Scalar


class SeriesStep(AbstractFlowStep):
    """A step by the Taylor series of the solution.

    Its length is such that the last terms are within the tolerance for the state, for the guards,
    and for a small disturbance of state and parameters in a fixed general direction: a state at
    rest would allow any step, but its derivatives would be wrong.

    - `order`: the highest power of time.
    """

    order: int = eqx.field(static=True)

    def begin(self, equations: Equations, t: Scalar, y: State, mode: Mode) -> _Memory:
        unit = time_scale(lambda t, y: equations.flow(t, y, mode), t, y)
        return _Memory(unit, jnp.full_like(t, jnp.inf))

    def attempt(
        self, equations: Equations, start: Point, tolerance: Scalar, scale: State
    ) -> Attempt:
        unit, cap = start.memory.step
        variable, fixed = eqx.partition(equations, eqx.is_inexact_array)

        def expanded(
            variable: Equations, y: State
        ) -> tuple[Coefficients, list[Float[Array, " guards"]]]:
            own = eqx.combine(variable, fixed)
            return with_guards(self.order, own, start.t, y, start.mode, unit)

        place = variable, start.y
        (states, guards), (disturbed, swayed) = jax.jvp(expanded, place, direction(place))
        heads = states.at[0].set(jnp.maximum(jnp.abs(states[0]), packed(scale)))
        longest = jnp.min(longest_accurate([list(heads), list(disturbed)], tolerance))
        if guards[0].size:
            longest = jnp.minimum(longest, jnp.min(longest_accurate([guards], tolerance)))
        longest = jnp.where(jnp.all(jnp.isfinite(jnp.stack(guards))), longest, jnp.nan)
        natural = jnp.minimum(longest, _LONGEST) * unit
        natural = jnp.minimum(natural, equations.smooth_for(start.t, start.mode))
        planned = rescaled(guards, natural / unit)
        usual = jnp.minimum(unit / natural, 1.0)
        planned = cleaned(planned, swayed[0], usual, start.memory, tolerance)
        h = jnp.minimum(jnp.minimum(natural, cap), natural * until_return(planned))
        armed = arm(rescaled(planned, h / natural), start.memory, tolerance)
        found = watch(armed, h <= _RESOLUTION * natural, 0.0, jnp.int32(NO_EVENT))
        shorter = shortened(h, found.fraction, start.t)
        taken = jnp.where(found.unclear, shorter, h * jnp.minimum(found.fraction, 1.0))
        expansion = _Expansion(states, unit)
        end = self.evaluate(equations, start.y, start.mode, expansion, taken, jnp.zeros_like(taken))
        following = jnp.minimum(natural, jnp.maximum(_LONGEST * taken, unit))
        after = _Memory(
            jnp.where(found.unclear, unit, following),
            jnp.where(found.unclear, shorter, jnp.inf),
        )
        return Attempt(
            ~found.unclear, taken, unit, end, found.event, found.caused, found.armed, after
        )

    def expand(
        self, equations: Equations, t: Scalar, y: State, mode: Mode, unit: Scalar
    ) -> _Expansion:
        return _expanded(self.order, equations, t, y, mode, unit)

    def evaluate(
        self,
        equations: Equations,
        like: State,
        mode: Mode,
        expansion: _Expansion,
        s: Scalar,
        delay: Scalar,
    ) -> State:
        del equations, mode
        coefficients, unit = expansion
        unit = jax.lax.stop_gradient(unit)  # its derivative is zero; here the compiler can see it
        numbers = jax.vmap(polynomial, (1, None, None))(coefficients, s / unit, delay / unit)
        return unpacked(numbers, like)


@eqx.filter_jit  # so that it is traced once
def _expanded(
    order: int, equations: Equations, t: Scalar, y: State, mode: Mode, unit: Scalar
) -> _Expansion:
    leaves, structure = jax.tree.flatten(y)

    def field(t: Scalar, *leaves: Array) -> list[Array]:
        y = jax.tree.unflatten(structure, leaves)
        return jax.tree.leaves(equations.flow(t, y, mode))

    states, _ = solution_series(field, t, leaves, order, unit, AWAY_FROM_SINGULARITIES)
    return _Expansion(_stacked(states), unit)


def with_guards(
    order: int, equations: Equations, t: Scalar, y: State, mode: Mode, unit: Scalar
) -> tuple[Coefficients, list[Float[Array, " guards"]]]:
    """Series of the state and of all guards.

    Raises `NotAnalytic` if an operation has no recurrence.
    """
    leaves, structure = jax.tree.flatten(y)

    def field(t: Scalar, *leaves: Array) -> list[Array]:
        y = jax.tree.unflatten(structure, leaves)
        return [*jax.tree.leaves(equations.flow(t, y, mode)), *equations.guards(t, y, mode)]

    states, guards = solution_series(field, t, leaves, order, unit, AWAY_FROM_SINGULARITIES)
    if not guards:
        return _stacked(states), [jnp.zeros(0, unit.dtype)] * (order + 1)
    return _stacked(states), [jnp.stack(each) for each in zip(*guards, strict=True)]


def _stacked(series: list[list[Array]]) -> Coefficients:
    return jnp.concatenate([jnp.stack(each).reshape(len(each), -1) for each in series], axis=1)
