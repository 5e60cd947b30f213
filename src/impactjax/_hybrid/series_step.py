"""A step by the Taylor series of the solution of any flow."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from impactjax._hybrid.equations import Equations
from impactjax._hybrid.lane import Point
from impactjax._hybrid.step import AbstractFlowStep, Attempt
from impactjax._hybrid.system import Mode, State
from impactjax._hybrid.watch import arm, cleaned, until_return, watch
from impactjax._simulate.accuracy import longest_accurate
from impactjax._simulate.crossing import shortened
from impactjax._simulate.polynomial import polynomial, rescaled
from impactjax._simulate.taylor import solution_series
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
        return _Memory(_time_scale(equations, t, y, mode), jnp.full_like(t, jnp.inf))

    def attempt(
        self, equations: Equations, start: Point, tolerance: Scalar, scale: State
    ) -> Attempt:
        unit, cap = start.memory.step
        variable, fixed = eqx.partition(equations, eqx.is_inexact_array)

        def expanded(
            variable: Equations, y: State
        ) -> tuple[Coefficients, list[Float[Array, " guards"]]]:
            own = eqx.combine(variable, fixed)
            return _with_guards(self.order, own, start._replace(y=y), unit)

        place = variable, start.y
        (states, guards), (disturbed, _) = jax.jvp(expanded, place, _direction(place))
        floor = jnp.concatenate([jnp.ravel(each) for each in jax.tree.leaves(scale)])
        heads = states.at[0].set(jnp.maximum(jnp.abs(states[0]), floor))
        longest = jnp.min(longest_accurate([list(heads), list(disturbed)], tolerance))
        if guards[0].size:
            longest = jnp.minimum(longest, jnp.min(longest_accurate([guards], tolerance)))
        natural = jnp.minimum(longest, _LONGEST) * unit
        planned = cleaned(rescaled(guards, natural / unit), start.memory, tolerance)
        h = jnp.minimum(jnp.minimum(natural, cap), natural * until_return(planned))
        armed = arm(rescaled(planned, h / natural), start.memory, tolerance)
        found = watch(armed, h <= _RESOLUTION * natural)
        shorter = shortened(h, found.fraction, start.t)
        taken = jnp.where(found.unclear, shorter, h * jnp.minimum(found.fraction, 1.0))
        expansion = _Expansion(states, unit)
        end = self.evaluate(
            equations, start.y, start.mode, expansion, taken, jnp.zeros_like(taken)
        )
        following = jnp.minimum(natural, jnp.maximum(_LONGEST * taken, unit))
        after = _Memory(
            jnp.where(found.unclear, unit, following),
            jnp.where(found.unclear, shorter, jnp.inf),
        )
        return Attempt(~found.unclear, taken, unit, end, found.event, found.armed, after)

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
        return _unpacked(numbers, like)


@jax.jit(static_argnums=0)  # so that it is traced once
def _expanded(
    order: int, equations: Equations, t: Scalar, y: State, mode: Mode, unit: Scalar
) -> _Expansion:
    leaves, structure = jax.tree.flatten(y)

    def field(t: Scalar, *leaves: Array) -> list[Array]:
        y = jax.tree.unflatten(structure, leaves)
        return jax.tree.leaves(equations.flow(t, y, mode))

    states, _ = solution_series(field, t, leaves, order, unit)
    return _Expansion(_packed(states), unit)


def _with_guards(
    order: int, equations: Equations, start: Point, unit: Scalar
) -> tuple[Coefficients, list[Float[Array, " guards"]]]:
    """Series of the state and of all guards."""
    leaves, structure = jax.tree.flatten(start.y)

    def field(t: Scalar, *leaves: Array) -> list[Array]:
        y = jax.tree.unflatten(structure, leaves)
        rates = jax.tree.leaves(equations.flow(t, y, start.mode))
        return [*rates, *equations.guards(t, y, start.mode)]

    states, guards = solution_series(field, start.t, leaves, order, unit)
    if not guards:
        return _packed(states), [jnp.zeros(0, unit.dtype)] * (order + 1)
    return _packed(states), [jnp.stack(each) for each in zip(*guards, strict=True)]


def _packed(series: list[list[Array]]) -> Coefficients:
    return jnp.concatenate([jnp.stack(each).reshape(len(each), -1) for each in series], axis=1)


def _unpacked(numbers: Float[Array, " numbers"], like: State) -> State:
    leaves, structure = jax.tree.flatten(like)
    ends = np.cumsum([leaf.size for leaf in leaves])
    parts = jnp.split(numbers, ends[:-1])
    shaped = [part.reshape(leaf.shape) for part, leaf in zip(parts, leaves, strict=True)]
    return jax.tree.unflatten(structure, shaped)


def _direction(place: PyTree) -> PyTree:
    """A fixed direction in which nothing is special, of about the size of each number."""
    leaves, structure = jax.tree.flatten(place)
    random = np.random.default_rng(0)

    def one(leaf: Array) -> Array:
        share = random.uniform(0.5, 1.5, leaf.shape) * random.choice([-1.0, 1.0], leaf.shape)
        return jnp.where(leaf == 0, 1.0, leaf) * share.astype(leaf.dtype)

    return jax.tree.unflatten(structure, [one(leaf) for leaf in leaves])


def _time_scale(equations: Equations, t: Scalar, y: State, mode: Mode) -> Scalar:
    """The least of the times |y′/y″| and √|y/y″|; 1 if there is none. It only scales a series."""

    def flow(t: Scalar, y: State) -> State:
        return equations.flow(t, y, mode)

    rate = flow(t, y)
    _, bend = jax.jvp(flow, (t, y), (jnp.ones_like(t), rate))
    value, slope, second = (
        jnp.concatenate([jnp.ravel(leaf) for leaf in jax.tree.leaves(each)])
        for each in (y, rate, bend)
    )
    safe = jnp.where(second == 0, 1.0, second)
    times = jnp.stack([jnp.abs(slope / safe), jnp.sqrt(jnp.abs(value / safe))])
    usable = (second != 0) & (times > 0) & jnp.isfinite(times)
    least = jnp.min(jnp.where(usable, times, jnp.inf))
    return jnp.where(jnp.isfinite(least), least, 1.0)
