"""A mechanism as a hybrid system."""

from collections.abc import Sequence
from typing import TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from impactjax._hybrid.lane import Start
from impactjax._hybrid.system import HybridSystem, Tail, Transition
from impactjax._known import is_known
from impactjax._mechanics.mechanism import AbstractMechanism, Coordinates, energy, gaps
from impactjax._mechanics.motion import (
    DETACHED,
    FREE,
    RESTING,
    TOUCHING,
    AtPlaces,
    Geometry,
    Mask,
    MechanicalState,
    Phases,
    closing,
    geometry,
    internal_rates,
    is_held,
    motion,
    with_phase,
)
from impactjax._mechanics.sliding import after_impact, after_stop, blocked, sliding
from impactjax._model.law import AbstractForceLaw, AbstractImpactLaw, Internal
from impactjax._model.separation import AtZeroForce
from impactjax._parameter import as_parameter
from impactjax._refusal import check_kind
from impactjax._types import Numbers, Scalar

AtContacts: TypeAlias = Bool[Array, " contacts"]

_MOMENT = 0.01  # of the longest sum: so long after a release its motion is not yet noticeable
_UNCHANGED = 1e-9  # of the speed of an impact: a change of another gap's rate that is rounding


class MechanicalSystem(HybridSystem):
    """A mechanism with its contacts, for `solve` and `section`.

    The state is a `MechanicalState`; the mode holds the phase of each contact: 0 free, 1 touching,
    2 detached (inside the indentation, without force), 3 resting; and after these that of each
    friction: 0 sticking, ±1 the direction of slip. Transitions are numbered by contact: one for
    each, and after it one more for a force law that separates at zero force; then by friction.

    An impact at a rigid contact changes v by −(1 + r) (n·v) M⁻¹n / (nᵀ M⁻¹ n). Of several contacts
    at one time the impacts come one after the other, in the order of the contacts. An endless
    series of impacts, at one contact or at several together, is summed once it lasts less than
    `longest_sum`; rates after it are known up to the second power of its duration.

    Friction has no impulse at an impact. Contacts that rest and frictions that stick together must
    be independent: of two that hold one part at the same place no force is determined, and where
    both hold it the run ends with `RESULTS.non_finite`. The exception is a friction that one
    resting contact holds at rest: it acts against the release of that contact.

    **Arguments:**

    - `mechanism`: the mechanism.
    - `longest_sum`: duration [s].
    """

    mechanism: AbstractMechanism
    longest_sum: Array
    _whole: Array

    def __init__(self, mechanism: AbstractMechanism, longest_sum: ArrayLike = 1e-5) -> None:
        check_kind("mechanism", mechanism, AbstractMechanism, "CartPendulum(...)")
        self.mechanism = mechanism
        self.longest_sum = as_parameter(longest_sum)
        self._whole = as_parameter(1.0)

    def start(self, t: ArrayLike, q: Numbers, v: Numbers) -> Start:
        """The start of a run with coordinates `q` and their rates `v`; compliant contacts whose gap
        is negative touch already.

        **Raises** `ValueError` for a rigid contact that is penetrated. Under `jit` the run then
        ends with `RESULTS.non_finite`.
        """
        place, rates = jnp.asarray(q, float), jnp.asarray(v, float)
        still = MechanicalState(place, rates, ())
        phases, internal = self._contacts_at(still)
        for number, each in enumerate(self.mechanism.contacts()):
            if each.law.is_rigid():
                rates = self._unless_inside(number, place, rates)
        y = MechanicalState(place, rates, internal)
        return Start(t, y, self._with_slips(jnp.asarray(t, place.dtype), y, phases))

    def _contacts_at(self, still: MechanicalState) -> tuple[Phases, tuple[Internal, ...]]:
        """Phases and internal states of the contacts at a start; frictions slip."""
        contacts, frictions = self.mechanism.contacts(), len(self.mechanism.friction())
        phases, internal = jnp.zeros(len(contacts) + frictions, jnp.int32), []
        for number, each in enumerate(contacts):
            if isinstance(each.law, AbstractForceLaw):
                mass = 1 / geometry(self.mechanism, still).compliance[number, number]
                internal.append(each.law.touch(jnp.zeros_like(mass), mass))
                touches = gaps(self.mechanism, still.q)[number] < 0
                phases = with_phase(phases, number, jnp.where(touches, TOUCHING, FREE))
            else:
                internal.append(())
        return phases, tuple(internal)

    def _unless_inside(self, number: int, q: Coordinates, v: Coordinates) -> Coordinates:
        """The rates `v`; NaN, or a `ValueError`, for a rigid contact that is penetrated."""
        inside = gaps(self.mechanism, q)[number] < 0
        if is_known(inside) and inside:
            raise ValueError(f"The start lies inside contact {number}, which is rigid.")
        return jnp.where(inside, jnp.nan, v)

    def _with_slips(self, t: Scalar, y: MechanicalState, phases: Phases) -> Phases:
        """Phases with those of the frictions at a start: they stick at rest if they can."""
        contacts = len(self.mechanism.contacts())
        for number in range(len(self.mechanism.friction())):
            own = contacts + number
            rate = geometry(self.mechanism, y).rate[own]
            slips = with_phase(phases, own, jnp.where(rate < 0, -1, 1))
            still = after_stop(self.mechanism, t, y, slips, number)
            phases = jnp.where(rate == 0, with_phase(phases, own, still), slips)
        return phases

    def energy(self, t: ArrayLike, y: MechanicalState) -> Scalar:
        """Kinetic and potential energy [J] of a state, without that stored in contacts."""
        return energy(self.mechanism, jnp.asarray(t), y.q, y.v)

    def flow(self, t: Scalar, y: MechanicalState, mode: Phases) -> MechanicalState:
        """Rates of the state.

        At rest some rates are a difference that is zero up to rounding. The factor `_whole`, which
        is 1, lets a step that is disturbed see how large its terms are.
        """
        acceleration, kept, _ = motion(self.mechanism, t, y, mode)
        acceleration = acceleration + (self._whole.astype(kept.dtype) - 1) * kept
        return MechanicalState(y.v, acceleration, internal_rates(self.mechanism, y, mode))

    def smooth_until(self, t: Scalar, mode: Phases) -> Scalar | None:
        del mode
        return self.mechanism.smooth_until(t)

    def transitions(self) -> Sequence[Transition]:
        found = []
        for number, each in enumerate(self.mechanism.contacts()):
            if isinstance(each.law, AbstractImpactLaw):
                found.append(self._rigid(number, each.law))
            elif isinstance(each.law, AbstractForceLaw):
                found.append(self._surface(number, each.law))
                if isinstance(each.law.separation, AtZeroForce):
                    found.append(self._pull_free(number))
        frictions = range(len(self.mechanism.friction()))
        return [*found, *(sliding(self.mechanism, number) for number in frictions)]

    def _rigid(self, number: int, law: AbstractImpactLaw) -> Transition:
        """An impact, or the release from rest."""

        def guard(t: Scalar, y: MechanicalState, mode: Phases) -> Scalar:
            push = motion(self.mechanism, t, y, mode).push[number]
            gap = gaps(self.mechanism, y.q)[number]
            return jnp.where(mode[number] == RESTING, push, gap)

        def jump(t: Scalar, y: MechanicalState, mode: Phases) -> tuple[MechanicalState, Phases]:
            place = geometry(self.mechanism, y)
            rests = mode[number] == RESTING
            rate = place.rate[number]
            impulse = -(1 + law.restitution(jnp.abs(rate))) * rate
            impulse = impulse / place.compliance[number, number]
            opening = self._opening(number, t, y, mode)
            impulse = jnp.where(rests, (opening - rate) / place.compliance[number, number], impulse)
            change = impulse * place.mobility[:, number]
            moved = jnp.abs(place.normals @ change) > _UNCHANGED * jnp.abs(rate)
            freed = after_impact(self.mechanism, place, change, mode, moved & ~rests)
            after = with_phase(freed, number, FREE)
            opened = jnp.where(rests, _lifted(place, number, y.q), 0.0)
            return y._replace(q=y.q + opened, v=y.v + change), after

        def tail(t: Scalar, y: MechanicalState, mode: Phases) -> Tail:
            place = geometry(self.mechanism, y)
            series = self._chattering(number, place, mode)
            closed = jnp.where(self._at_all_places(series), RESTING, mode)
            block = blocked(place, closed)
            closed = jnp.where(block == 0, closed, block)
            stopping = closing(place, is_held(self.mechanism, closed), -place.rate)
            stopped = y.v + place.mobility @ stopping
            still = y._replace(v=stopped)
            held = motion(self.mechanism, t, still, closed)
            falls, durations = self._durations(place, held.push)
            duration = jnp.max(jnp.where(series & falls, durations, 0.0))
            change = internal_rates(self.mechanism, still, closed)
            flow = MechanicalState(stopped, held.acceleration, change)
            end = jax.tree.map(lambda x, dx: x + duration * dx, still, flow)
            end = end._replace(q=end.q + duration**2 / 2 * flow.v)
            soon = jax.tree.map(lambda x, dx: x + self.longest_sum * dx, still, flow)
            later = motion(self.mechanism, t + self.longest_sum, soon, closed).push
            stays = falls & (later[: falls.size] > 0)
            holds = (place.rate[number] >= 0) & jnp.all(stays | ~series)
            return Tail(holds & (duration <= self.longest_sum), duration, end, closed)

        return Transition(guard, jump, tail)

    def _opening(self, number: int, t: Scalar, y: MechanicalState, mode: Phases) -> Scalar:
        """Rate of a gap a moment after its release, when it exceeds what is due to rounding.

        At the release rate and acceleration are zero, and their signs those of rounding.
        """
        wait = self.longest_sum.astype(t.dtype)
        soon = jax.tree.map(lambda x, dx: x + wait * dx, y, self.flow(t, y, mode))
        pull = -motion(self.mechanism, t + wait, soon, mode).push[number]
        compliance = geometry(self.mechanism, y).compliance[number, number]
        rate = pull * compliance * wait / 2 * _MOMENT**2
        return jax.lax.stop_gradient(jnp.maximum(rate, 0.0))

    def _at_all_places(self, series: AtContacts) -> Mask:
        """False for frictions, beside contacts."""
        frictions = len(self.mechanism.friction())
        return jnp.concatenate([series, jnp.zeros(frictions, bool)]) if frictions else series

    def _chattering(self, number: int, place: Geometry, mode: Phases) -> AtContacts:
        """The contacts that come to rest together: one, and those that it may meet before."""
        rate, phases = place.rate[: place.gap.size], mode[: place.gap.size]
        reach = self.longest_sum * jnp.maximum(jnp.abs(rate), jnp.abs(rate[number]))
        near = (phases == FREE) & (rate != 0) & (place.gap <= reach)
        return near | (jnp.arange(rate.size, dtype=jnp.int32) == number)

    def _durations(
        self, place: Geometry, push: AtPlaces
    ) -> tuple[AtContacts, Float[Array, " contacts"]]:
        """True for each rigid contact with an endless series of impacts, and its duration."""
        falls, durations = [], []
        for number, each in enumerate(self.mechanism.contacts()):
            falling = push[number] * place.compliance[number, number]
            speed = jnp.abs(place.rate[number])
            r = each.law.restitution(speed) if isinstance(each.law, AbstractImpactLaw) else 1.0
            ends = (falling > 0) & (r < 1)
            falls.append(ends)
            durations.append(2 * speed / jnp.where(ends, falling * (1 - r), 1.0))
        return jnp.stack(falls), jnp.stack(durations)

    def _surface(self, number: int, law: AbstractForceLaw) -> Transition:
        """The beginning of contact, or its end at the surface."""

        def guard(t: Scalar, y: MechanicalState, mode: Phases) -> Scalar:
            del t
            gap = gaps(self.mechanism, y.q)[number]
            return jnp.where(mode[number] == FREE, gap, -gap)

        def jump(t: Scalar, y: MechanicalState, mode: Phases) -> tuple[MechanicalState, Phases]:
            del t
            place, touches = geometry(self.mechanism, y), mode[number] == FREE
            mass = 1 / place.compliance[number, number]
            fresh = law.touch(jnp.maximum(-place.rate[number], 0.0), mass)
            own = jax.tree.map(
                lambda new, old: jnp.where(touches, new, old), fresh, y.internal[number]
            )
            internal = (*y.internal[:number], own, *y.internal[number + 1 :])
            after = with_phase(mode, number, jnp.where(touches, TOUCHING, FREE))
            return y._replace(internal=internal), after

        return Transition(guard, jump)

    def _pull_free(self, number: int) -> Transition:
        """Zero of the force inside the indentation: the contact detaches, or presses again."""

        def guard(t: Scalar, y: MechanicalState, mode: Phases) -> Scalar:
            pressed = with_phase(mode, number, TOUCHING)
            push = motion(self.mechanism, t, y, pressed).push[number]
            inside = jnp.where(mode[number] == DETACHED, -push, push)
            return jnp.where(mode[number] == FREE, jnp.ones_like(push), inside)

        def jump(t: Scalar, y: MechanicalState, mode: Phases) -> tuple[MechanicalState, Phases]:
            del t
            pressed = mode[number] == TOUCHING
            return y, with_phase(mode, number, jnp.where(pressed, DETACHED, TOUCHING))

        return Transition(guard, jump)


def _lifted(place: Geometry, number: int, q: Coordinates) -> Coordinates:
    """Displacement of the size of rounding that makes the gap of a contact positive.

    A contact that has rested may be closed by a rounding, and its fall would be no impact.
    """
    rounding = 4 * jnp.finfo(q.dtype).eps * jnp.abs(place.normals[number]) @ jnp.abs(q)
    width = jax.lax.stop_gradient(2 * jnp.abs(place.gap[number]) + rounding)
    share = place.mobility[:, number] / place.compliance[number, number]
    return jax.lax.stop_gradient(share) * width
