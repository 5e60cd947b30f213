"""A step by an explicit Runge-Kutta method of Diffrax."""

import math
from typing import TYPE_CHECKING, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from impactjax._hybrid.explicit_step import ExplicitStep
from impactjax._series.crossing import shortened
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.flow import driven_acceleration
from impactjax._simulate.grading import Grading, grading_of, time_to_surface
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


class _Expansion(NamedTuple):
    """Start of a step; samples within it are computed as separate steps from there."""

    t: Scalar
    y: State
    grading: Grading


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
    polynomials. A sample within a step is computed by a shorter step from the same start.

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
        end, error = _stepped(
            self.solver, automaton, start.t, start.y, start.mode, h, _SLOW * speed, grading
        )
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
    ) -> _Expansion:
        del h
        return _Expansion(t, y, grading_of(automaton, y, mode, event))

    def evaluate(
        self, automaton: Automaton, mode: Mode, expansion: _Expansion, s: Scalar, delay: Scalar
    ) -> State:
        t, y, grading = expansion
        slowest = jnp.zeros_like(s)
        return _stepped(self.solver, automaton, t, y, mode, s - delay, slowest, grading)[0]


@jax.jit(static_argnums=0)  # so that it is traced once, for attempts, samples and derivatives alike
def _stepped(
    solver: "diffrax.AbstractERK",
    automaton: Automaton,
    t: Scalar,
    y: State,
    mode: Mode,
    h: Scalar,
    slowest: Scalar,
    grading: Grading,
) -> tuple[State, Scalar]:
    """The state after `h`, and its error relative to the motion of the step, whose speed counts as
    at least `slowest`.

    The velocity that the mass would have without friction and stops is integrated too, so that it
    limits the step at rest as well.
    """
    leaves, structure = jax.tree.flatten(y)
    leaves = [*leaves, y.velocity]

    @jax.jit  # so that it is traced once, not stage by stage
    def rates(t: Scalar, leaves: list[Array]) -> list[Array]:
        state = jax.tree.unflatten(structure, leaves[:-1])
        drive = driven_acceleration(automaton.model, t, state, mode)
        return [*jax.tree.leaves(automaton.flow(t, state, mode)), drive]

    tableau = cast("diffrax.ButcherTableau", solver.tableau)
    first = rates(t, leaves)
    stages = [grading.stage(0.0, first)]
    for c, row in zip(map(float, tableau.c), tableau.a_lower, strict=True):
        moved = _advanced(leaves, h, row, stages)
        stages.append(grading.stage(c, rates(t + grading.share(c) * h, moved)))
    end = _advanced(leaves, h, tableau.b_sol, stages)
    still = [jnp.zeros_like(leaf) for leaf in leaves]
    errors = _advanced(still, h, tableau.b_error, stages)
    least = [still[0], slowest, *still[2:-1], slowest]  # of position, velocity, and so on
    scales = [
        jnp.maximum(jnp.maximum(jnp.abs(y0), jnp.abs(y1)), jnp.maximum(jnp.abs(h * dy), floor))
        for y0, y1, dy, floor in zip(leaves, end, first, least, strict=True)
    ]
    tiny = jnp.finfo(h.dtype).tiny
    relative = [jnp.abs(e) / (scale + tiny) for e, scale in zip(errors, scales, strict=True)]
    return jax.tree.unflatten(structure, end[:-1]), jnp.max(jnp.stack(relative))


def _advanced(
    leaves: list[Array], h: Scalar, weights: np.ndarray, stages: list[PyTree]
) -> list[Array]:
    """Sum y + h Σ wⱼ kⱼ, leaf by leaf."""
    weighted = [(float(w), stage) for w, stage in zip(weights, stages, strict=False) if w != 0]
    return [
        leaf + h * sum((w * stage[i] for w, stage in weighted), jnp.zeros_like(leaf))
        for i, leaf in enumerate(leaves)
    ]


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
