"""A step by an explicit Runge-Kutta method of Diffrax."""

import math
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from impactjax._hybrid.explicit_step import ExplicitStep
from impactjax._series.crossing import shortened
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.dense_output import Expansion, expanded, within
from impactjax._simulate.flow import driven_acceleration
from impactjax._simulate.grading import grading_of, time_to_surface
from impactjax._simulate.stages import Begin, ends_of_steps
from impactjax._simulate.state import Mode, State
from impactjax._simulate.step import AbstractStep, Outcome, Point
from impactjax._simulate.step_event import along_flow, first_event
from impactjax._types import Code, Flag, Scalar

if TYPE_CHECKING:
    import diffrax

_SAFETY = 0.9  # safety factor of the next step
_SHRINK, _GROW = 0.2, 10.0  # limits of the ratio of successive steps
_LONGEST = 100.0  # largest ratio of a step to the longest one before
_RESOLUTION = 1e-8  # of an event close to grazing, as a fraction of the first guess
_LOCAL = 0.5  # local error asked for, as a fraction of the tolerance
_CLOSE = 0.5  # time left to the surface after a step in a contact, relative to the step's duration
_CONFIRM = 0.7  # share of a step that begins a contact, at which it must be accurate too
_SLOW = 1e-4  # of the largest speed: errors of a slower mass need not be smaller


class _Memory(NamedTuple):
    h: Scalar  # [s], the duration to try; zero asks for a first guess
    unit: Scalar  # [s], the longest so far
    target: Code  # the transition being landed on, or NO_EVENT
    speed: Scalar  # the largest so far, in units of the coordinate
    confirms: Flag  # true if a longer step from the same start was accurate


def _dopri8() -> "diffrax.AbstractERK":
    import diffrax  # half a second that laws with Taylor steps can do without

    return diffrax.Dopri8()


class RungeKutta(AbstractStep):
    """A step by an explicit Runge-Kutta method, for any equations of motion.

    A step that ends beyond an event is repeated with a shorter duration, by Newton's method, until
    it ends on the event. Guards are checked inside the step through their quintic Hermite
    polynomials. Samples within a step are those of a polynomial through shorter steps from the same
    start.

    **Arguments:**

    - `solver`: an explicit method with an embedded error estimate, such as `diffrax.Dopri8()`,
      `diffrax.Tsit5()` or `diffrax.Bosh3()`; only its Butcher tableau is used.
    """

    solver: "diffrax.AbstractERK" = eqx.field(default_factory=_dopri8, static=True)

    def __check_init__(self) -> None:
        import diffrax

        if not isinstance(self.solver, diffrax.AbstractERK):
            raise ValueError(
                "Argument `solver` must be an explicit Runge-Kutta method with an embedded error "
                f"estimate, such as `diffrax.Dopri8()`, but it is {self.solver}."
            )

    def of_flows(self) -> ExplicitStep:
        return ExplicitStep(self.solver)

    def begin(self, unit: Scalar) -> _Memory:
        zero = jnp.zeros_like(unit)
        return _Memory(zero, unit, jnp.int32(NO_EVENT), zero, jnp.zeros((), bool))

    @property
    def power(self) -> int:
        order = self.solver.order(None)  # pyright: ignore[reportArgumentType]  terms do not matter
        assert order is not None
        return order + 1

    def reach(self, tolerance: Scalar) -> Scalar:
        return (_LOCAL * tolerance * math.factorial(self.power)) ** (1 / self.power)

    def attempt(
        self,
        automaton: Automaton,
        start: Point,
        longest: Scalar,
        tolerance: Scalar,
        memory: _Memory,
    ) -> Outcome:
        order = self.power - 1
        longest = jnp.minimum(longest, _LONGEST * memory.unit)
        guess = jnp.minimum(_first_guess(automaton, start, tolerance, order), longest)
        h = jnp.minimum(jnp.where(memory.h > 0, memory.h, guess), longest)
        speed = jnp.maximum(memory.speed, jnp.abs(start.y.velocity))
        grading = grading_of(automaton, start.y, start.mode, memory.target)
        begin, slowest = Begin(start.t, start.y, grading), _SLOW * speed
        ends, errors = ends_of_steps(self.solver, automaton, start.mode, begin, h[None], slowest)
        end, error = jax.tree.map(lambda each: each[0], ends), errors[0]
        ratio = error / (_LOCAL * tolerance)
        ratio = jnp.where(jnp.isnan(ratio), jnp.inf, ratio)  # overflow: the step is much too long
        accurate = ratio <= 1
        factor = jnp.clip(_SAFETY * jnp.maximum(ratio, 1e-30) ** (-1 / order), _SHRINK, _GROW)

        # Accepted if accurate and clear, and either without an event ahead (`plain`), or ending on
        # it (`landed`), or with it at the start, as a step of duration zero (`at_once`).
        settle = h <= _RESOLUTION * guess
        event, fraction, unclear = first_event(automaton, start, end, h, memory.target, settle)
        found = accurate & (event != NO_EVENT)
        landed = found & (jnp.abs(fraction - 1) <= math.sqrt(np.finfo(h.dtype).eps))
        at_once = found & ~unclear & (start.t + fraction * h == start.t)
        beyond = found & (fraction > 1) & (h >= longest)
        plain = accurate & ~unclear & ((event == NO_EVENT) | (beyond & ~landed))
        # Of a force that is not smooth at the surface the errors of two powers may cancel in the
        # estimate, but only near one length.
        unconfirmed = plain & (grading.begins > 0) & ~memory.confirms
        # The derivative of such a force is not smooth either, and the estimate does not see its
        # error: a step must not end much closer to the surface than it is long.
        left = time_to_surface(automaton, end, start.mode)
        close = plain & (left < _CLOSE * h)
        plain = plain & ~unconfirmed & ~close

        correction = jnp.where(landed, (fraction - 1) * h, 0.0)
        rate = automaton.flow(start.t + h, end, start.mode)
        end = jax.tree.map(lambda y, dy: y + dy * correction, end, rate)
        end = jax.tree.map(lambda y0, y1: jnp.where(at_once, y0, y1), start.y, end)
        taken = jnp.where(at_once, 0.0, h + correction)

        unit = jnp.maximum(memory.unit, jnp.where(plain, h, 0.0))
        ends_on_event = (landed & ~unclear) | at_once
        accepted = plain | ends_on_event
        end = jax.tree.map(lambda y0, y1: jnp.where(accepted, y1, y0), start.y, end)
        retry = jnp.where(found, fraction * h, h * factor)
        retry = jnp.where(unconfirmed, _CONFIRM * h, retry)
        retry = jnp.where(close, (h + left) / 2, retry)
        retry = jnp.where(accurate & unclear, shortened(h, fraction, start.t), retry)
        following = jnp.where(ends_on_event, 0.0, jnp.where(plain, h * factor, retry))
        target = jnp.where(found & ~unclear & ~ends_on_event & ~plain, event, NO_EVENT)
        return Outcome(
            accepted,
            taken,
            end,
            jnp.where(ends_on_event, event, NO_EVENT).astype(jnp.int32),
            _Memory(following, unit, target.astype(jnp.int32), speed, unconfirmed),
        )

    def expand(
        self, automaton: Automaton, t: Scalar, y: State, mode: Mode, h: Scalar, event: Code
    ) -> Expansion:
        begin = Begin(t, y, grading_of(automaton, y, mode, event))
        return expanded(self.solver, automaton, mode, begin, h)

    def evaluate(
        self, automaton: Automaton, mode: Mode, expansion: Expansion, s: Scalar, delay: Scalar
    ) -> State:
        return within(automaton, mode, expansion, s, delay)

    def end(self, automaton: Automaton, mode: Mode, expansion: Expansion, h: Scalar) -> State:
        begin, slowest = expansion.begin, jnp.zeros_like(h)
        ends, _ = ends_of_steps(self.solver, automaton, mode, begin, h[None], slowest)
        return jax.tree.map(lambda each: each[0], ends)


def _first_guess(automaton: Automaton, start: Point, tolerance: Scalar, order: int) -> Scalar:
    """A first step from the time scales of the driven acceleration.

    The third one is needed for a mass that is released and initially has no acceleration either.
    """

    def acceleration(t: Scalar, y: State) -> Scalar:
        return driven_acceleration(automaton.model, t, y, start.mode)

    def jerk(t: Scalar, y: State) -> Scalar:
        return along_flow(automaton, acceleration, t, y, start.mode)

    def snap(t: Scalar, y: State) -> Scalar:
        return along_flow(automaton, jerk, t, y, start.mode)

    tiny = jnp.finfo(start.t.dtype).tiny
    first, second, third = (
        jnp.abs(rate(start.t, start.y)) + tiny for rate in (acceleration, jerk, snap)
    )
    scale = jnp.maximum(first / second, jnp.sqrt(jnp.abs(start.y.velocity) / second))
    released = (start.y.velocity == 0) & jnp.isfinite(third)
    scale = jnp.maximum(scale, jnp.where(released, second / third, 0.0))
    return (_LOCAL * tolerance) ** (1 / order) * jnp.where(scale > 0, scale, jnp.inf)
