"""A step by the solution's own Taylor series."""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from impactjax._hybrid.series_step import SeriesStep
from impactjax._series.accuracy import LAST_TERM, longest_accurate
from impactjax._series.crossing import first_crossing, shortened
from impactjax._series.order import LOWEST_ORDER
from impactjax._series.polynomial import polynomial, rescaled, slope
from impactjax._series.recurrences.series import Series
from impactjax._series.taylor import solution_series
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.flow import unheld_acceleration
from impactjax._simulate.state import Mode, State
from impactjax._simulate.step import AbstractStep, Outcome, Point
from impactjax._types import Code, Flag, Scalar

_LONGEST = 100.0  # largest ratio of a step to the one before
_RESOLUTION = 1e-8  # of an event close to grazing, as a fraction of the natural step
_FLIGHTS = 2.0  # a step from the surface is at most as long as this many expected flights


class _Memory(NamedTuple):
    unit: Scalar  # [s], the unit of time for the next series: about the length of a step
    cap: Scalar  # [s], at most as long as this


class _Expansion(NamedTuple):
    """The series of a step: the velocity is the derivative of the position."""

    position: Array  # coefficients
    internal: PyTree  # arrays of coefficients
    unit: Scalar  # [s]


class TaylorStep(AbstractStep):
    """A step by the Taylor series of the solution, for analytic equations of motion.

    The series gives the longest step within the tolerance, without trial and error. Events are
    roots of its polynomials, isolated rigorously. The polynomial is the dense output.

    **Arguments:**

    - `order`: the highest power of time in the position.
    """

    order: int = eqx.field(default=15, static=True)

    def __check_init__(self) -> None:
        if not isinstance(self.order, int):
            raise TypeError(f"Argument `order` must be a whole number, but it is {self.order!r}.")
        if self.order < LOWEST_ORDER:
            raise ValueError(
                f"Argument `order` must be at least {LOWEST_ORDER}, but it is {self.order}."
            )

    def of_flows(self) -> SeriesStep:
        return SeriesStep(self.order)

    def begin(self, unit: Scalar) -> _Memory:
        return _Memory(unit, jnp.full_like(unit, jnp.inf))

    @property
    def power(self) -> int:
        return self.order - 1  # of the last term of the velocity

    def reach(self, tolerance: Scalar) -> Scalar:
        logarithm = jnp.log(LAST_TERM * tolerance) + math.lgamma(self.power + 1)
        return jnp.exp(logarithm / self.power)

    def attempt(
        self,
        automaton: Automaton,
        start: Point,
        longest: Scalar,
        tolerance: Scalar,
        memory: _Memory,
    ) -> Outcome:
        unit = memory.unit
        position, internal, drive, guards = self._series(automaton, start, unit)
        speeds = [_if_free(start.y.velocity, drive, unit), *internal]
        natural = jnp.minimum(longest_accurate(speeds, tolerance), _LONGEST) * unit
        natural = jnp.minimum(natural, longest)
        h = jnp.minimum(natural, memory.cap)
        for guard in guards:
            h = jnp.minimum(h, _FLIGHTS * unit * _flight_time(guard))
        settle = h <= _RESOLUTION * natural
        scaled = [rescaled(guard, h / unit) for guard in guards]
        heads = [(guard[0], guard[1], guard[2]) for guard in scaled]
        heads = automaton.just_after(start.arrival, start.mode, heads)
        cleaned = [[*head, *guard[3:]] for head, guard in zip(heads, scaled, strict=True)]
        event, fraction, unclear = _first_event(cleaned, settle)
        shorter = shortened(h, fraction, start.t)
        h = jnp.where(unclear, shorter, h * jnp.minimum(fraction, 1.0))
        expansion = _packed(start.y, position, internal, unit)
        end = self.end(automaton, start.mode, expansion, h)
        following = jnp.minimum(natural, jnp.maximum(_LONGEST * h, unit))
        after = _Memory(following, jnp.where(unclear, shorter, jnp.inf))
        return Outcome(~unclear, h, end, event, after)

    def expand(
        self, automaton: Automaton, t: Scalar, y: State, mode: Mode, h: Scalar, event: Code
    ) -> _Expansion:
        del event
        return _expanded(self.order, automaton, t, y, mode, h)

    def evaluate(
        self, automaton: Automaton, mode: Mode, expansion: _Expansion, s: Scalar, delay: Scalar
    ) -> State:
        del automaton, mode
        position, internal, unit = expansion
        unit = jax.lax.stop_gradient(unit)  # its derivative is zero; here the compiler can see it
        w, delay = s / unit, delay / unit
        return State(
            polynomial(position, w, delay),
            polynomial(slope(position), w, delay) / unit,
            jax.tree.map(lambda series: polynomial(series, w, delay), internal),
        )

    def end(self, automaton: Automaton, mode: Mode, expansion: _Expansion, h: Scalar) -> State:
        return self.evaluate(automaton, mode, expansion, h, jnp.zeros_like(h))

    def _series(
        self, automaton: Automaton, start: Point, unit: Scalar
    ) -> tuple[Series, list[Series], Series, list[Series]]:
        """Series of position, internal states, unheld acceleration, and guards."""
        leaves, structure = jax.tree.flatten(start.y)

        def field(t: Scalar, *leaves: Scalar) -> list[Scalar]:
            y = jax.tree.unflatten(structure, leaves)
            rates = jax.tree.leaves(automaton.flow(t, y, start.mode))
            drive = unheld_acceleration(automaton.model, t, y, start.mode)
            return [*rates, drive, *automaton.guards(t, y, start.mode)]

        states, (drive, *guards) = solution_series(field, start.t, leaves, self.order, unit)
        position, _, *internal = states
        return position, internal, drive, guards


@jax.jit(static_argnums=0)  # so that it is traced once
def _expanded(
    order: int, automaton: Automaton, t: Scalar, y: State, mode: Mode, h: Scalar
) -> _Expansion:
    unit = jnp.where(h > 0, h, 1.0)
    leaves, structure = jax.tree.flatten(y)

    def field(t: Scalar, *leaves: Scalar) -> list[Scalar]:
        return jax.tree.leaves(automaton.flow(t, jax.tree.unflatten(structure, leaves), mode))

    (position, _, *internal), _ = solution_series(field, t, leaves, order, unit)
    return _packed(y, position, internal, unit)


def _packed(y: State, position: Series, internal: list[Series], unit: Scalar) -> _Expansion:
    structure = jax.tree.structure(y.internal)
    stacked = jax.tree.unflatten(structure, [jnp.stack(each) for each in internal])
    return _Expansion(jnp.stack(position), stacked, unit)


def _first_event(guards: list[Series], settle: Flag) -> tuple[Code, Scalar, Flag]:
    """The first transition on a step, its place as a fraction of the step, and a flag if it is
    unclear.
    """
    event, unclear = jnp.int32(NO_EVENT), jnp.zeros((), bool)
    fraction = jnp.full_like(guards[0][0], jnp.inf) if guards else jnp.asarray(jnp.inf)
    for index, guard in enumerate(guards):
        crossing = first_crossing(guard, settle)
        earlier = crossing.fraction < fraction
        event = jnp.where(earlier, index, event).astype(jnp.int32)
        fraction = jnp.where(earlier, crossing.fraction, fraction)
        unclear = unclear | crossing.unclear
    return event, fraction, unclear & (fraction > 0)


def _if_free(velocity: Scalar, drive: Series, unit: Scalar) -> Series:
    """The series of the velocity without friction and stops, which also limits the step at rest.

    One term shorter than that of the position, of which it is the derivative.
    """
    return [velocity, *(a * (unit / (k + 1)) for k, a in enumerate(drive[:-2]))]


def _flight_time(guard: Series) -> Scalar:
    """Time after which a guard that rises from zero returns, as a parabola; else infinity."""
    returns = (guard[0] == 0) & (guard[1] > 0) & (guard[2] < 0)
    return jnp.where(returns, -guard[1] / jnp.where(returns, guard[2], 1.0), jnp.inf)
