"""The hybrid automaton of a model: its flow, its transitions, and the mode it starts in."""

from typing import TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw, AbstractImpactLaw
from impactjax._model.separation import AtZeroForce
from impactjax._simulate.chatter import Tail, harmless, tail, tail_state
from impactjax._simulate.compliant_stop import PullFree, Surface
from impactjax._simulate.flow import driven_acceleration, flow, has_resistance, is_held, walls
from impactjax._simulate.rigid_stop import RigidStop
from impactjax._simulate.settling import Settling
from impactjax._simulate.sliding import Sliding
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.transition import AbstractTransition, Context, Jump
from impactjax._types import Code, Flag, Scalar

NO_EVENT = -1
Head: TypeAlias = tuple[Scalar, Scalar, Scalar]  # the first coefficients of a guard in time


class Automaton(eqx.Module):
    """Flow, guards and jumps of a model."""

    model: ImpactOscillator
    transitions: tuple[AbstractTransition, ...]

    def __init__(self, model: ImpactOscillator) -> None:
        self.model = model
        self.transitions = transitions(model)

    def flow(self, t: Scalar, y: State, mode: Mode) -> State:
        """Time derivative of the state."""
        return flow(self.model, t, y, mode)

    def guards(self, t: Scalar, y: State, mode: Mode) -> list[Scalar]:
        """One value for each of the first transitions; those that follow have no guard."""
        values = [each.guard(self.model, t, y, mode) for each in self.transitions]
        return [value for value in values if value is not None]

    def jump(self, event: Code, t: Scalar, y: State, mode: Mode, context: Context) -> Jump:
        """State and mode after the transition numbered `event`; unchanged for `NO_EVENT`."""
        after = Jump(y, mode, jnp.ones((), bool))
        for index, transition in enumerate(self.transitions):
            taken = transition.jump(self.model, t, y, mode, context)
            after = jax.tree.map(
                lambda new, old, here=event == index: jnp.where(here, new, old), taken, after
            )
        return after

    def scattered(
        self, event: Code, t: Scalar, y: State, mode: Mode, after: State, factor: Scalar
    ) -> State:
        """The state after the transition numbered `event`, with the speed at which the mass leaves
        a stop multiplied by a factor.
        """
        leaves = self.leaves_stop(event, t, y, mode)
        return after._replace(velocity=jnp.where(leaves, factor, 1.0) * after.velocity)

    def begins_impact(self, event: Code, t: Scalar, y: State, mode: Mode) -> Flag:
        """True if the transition numbered `event` is the beginning of an impact."""
        begins = [each.begins_impact(t, y, mode) for each in self.transitions]
        return _chosen(event, begins)

    def leaves_stop(self, event: Code, t: Scalar, y: State, mode: Mode) -> Flag:
        """True if the mass leaves a stop by the transition numbered `event`."""
        return _chosen(event, [each.leaves_stop(t, y, mode) for each in self.transitions])

    def time_left(self, t: Scalar, y: State, mode: Mode) -> Scalar:
        """Duration of a summed chatter that starts with `y`; infinite in all other phases."""
        left = jnp.full_like(t, jnp.inf)
        for _, stop in self.rigid_stops():
            chattering = mode.at(Phase.CHATTER, stop.wall.index)
            duration = self._chatter(stop, t, y, chattering).duration()
            left = jnp.where(chattering, duration, left)
        return left

    def with_chatter(self, t: Scalar, y: State, mode: Mode, s: Scalar, flowed: State) -> State:
        """The state a time `s` after `y`: `flowed`, or the closed form of a summed chatter."""
        for _, stop in self.rigid_stops():
            chattering = mode.at(Phase.CHATTER, stop.wall.index)
            closed = tail_state(self._chatter(stop, t, y, chattering), stop.wall, y, s)
            flowed = jax.tree.map(
                lambda a, b, here=chattering: jnp.where(here, a, b), closed, flowed
            )
        return flowed

    def _chatter(self, stop: RigidStop, t: Scalar, y: State, chattering: Flag) -> Tail:
        """The series of a chatter; without chatter, an arbitrary series whose reverse-mode
        derivatives are finite.
        """
        moving = jnp.where(chattering, y.velocity, float(stop.wall.sign))
        series = tail(self.model, stop.wall, stop.law, t, y._replace(velocity=moving))
        return jax.tree.map(lambda a, b: jnp.where(chattering, a, b), series, harmless(moving))

    def rigid_stops(self) -> list[tuple[int, RigidStop]]:
        """The transitions at rigid stops with their numbers."""
        numbered = enumerate(self.transitions)
        return [(index, each) for index, each in numbered if isinstance(each, RigidStop)]

    def settling(self) -> list[int]:
        """Numbers of the transitions by which the mass settles in a stop: one, or none."""
        return [i for i, each in enumerate(self.transitions) if isinstance(each, Settling)]

    def just_after(self, event: Code, mode: Mode, guards: list[Head]) -> list[Head]:
        """Guards just after an event, with their first and second derivatives, corrected for
        rounding that would repeat the event.

        Example: at slip, as at release from a stop, speed and acceleration are both zero. The
        rounded acceleration may have the wrong sign, so that the mass would stop again at once.
        """
        moves = ~is_held(self.model, mode)
        cleaned = []
        numbered = enumerate(zip(self.transitions, guards, strict=False))
        for index, (transition, (value, slope, bend)) in numbered:
            here = event == index
            value = jnp.where(here & transition.guard_stays_zero, 0.0, value)
            repeats = here & moves & (value == 0)
            slope = jnp.where(repeats, jnp.maximum(slope, 0), slope)
            bend = jnp.where(repeats & (slope == 0), jnp.maximum(bend, 0), bend)
            cleaned.append((value, slope, bend))
        return cleaned


def _chosen(event: Code, answers: list[Flag]) -> Flag:
    """The answer of the transition numbered `event`; false for `NO_EVENT`."""
    chosen = jnp.zeros((), bool)
    for index, answer in enumerate(answers):
        chosen = jnp.where(event == index, answer, chosen)
    return chosen


def transitions(model: ImpactOscillator) -> tuple[AbstractTransition, ...]:
    """All transitions that can end a mode of this model. The earliest in time happens; the last one
    has no guard if the mass can settle.
    """
    found: list[AbstractTransition] = []
    for wall in walls(model):
        law = wall.stop.law
        if isinstance(law, AbstractForceLaw):
            found.append(Surface(wall, law))
            if isinstance(law.separation, AtZeroForce):
                found.append(PullFree(wall, law))
        elif isinstance(law, AbstractImpactLaw):
            found.append(RigidStop(wall, law))
    if has_resistance(model):
        found.append(Sliding())
    if any(not wall.stop.law.is_rigid() for wall in walls(model)):
        found.append(Settling())
    return tuple(found)


def with_internal(model: ImpactOscillator, position: Scalar, velocity: Scalar) -> State:
    """A state with the internal states of untouched stops.

    **Raises** `ValueError` for an internal state that does not consist of single numbers.
    """
    mass = model.oscillator.mass
    internal = tuple(
        wall.stop.law.touch(jnp.zeros_like(velocity), mass)
        if isinstance(wall.stop.law, AbstractForceLaw)
        else ()
        for wall in walls(model)
    )
    for leaf in jax.tree.leaves(internal):
        if jnp.shape(leaf):
            raise ValueError(
                f"A contact law has an internal state of shape {jnp.shape(leaf)}: make it a tuple "
                "of single numbers."
            )
    return State(position, velocity, internal)


def initial_mode(model: ImpactOscillator, t: Scalar, y: State) -> tuple[Mode, Flag]:
    """The mode of a state, and a flag for a position inside a rigid stop."""
    phase, stop = jnp.int32(Phase.FLIGHT), jnp.int32(0)
    inside = jnp.zeros((), bool)
    for wall in walls(model):
        clearance = wall.clearance(y.position)
        if isinstance(wall.stop.law, AbstractForceLaw):
            begins = Phase.CONTACT
            here = clearance < 0
        else:
            begins = Phase.REST
            inwards = -wall.sign * driven_acceleration(model, t, y, _flight()) >= 0
            here = (clearance == 0) & (y.velocity == 0) & inwards
            inside = inside | (clearance < 0)
        phase = jnp.where(here, begins, phase).astype(jnp.int32)
        stop = jnp.where(here, wall.index, stop).astype(jnp.int32)
    start = Mode(phase, stop, jnp.sign(y.velocity).astype(jnp.int32))
    if has_resistance(model):
        still = Sliding().direction(model, t, y, start._replace(friction=jnp.int32(1)))
        start = start._replace(friction=jnp.where(y.velocity == 0, still, start.friction))
    return start, inside


def _flight() -> Mode:
    return Mode(jnp.int32(Phase.FLIGHT), jnp.int32(0), jnp.int32(0))
