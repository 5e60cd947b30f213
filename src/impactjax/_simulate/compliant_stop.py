"""Events at a compliant stop: touch and separation."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._simulate.flow import Wall, contact_force
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.transition import AbstractTransition, Context, Jump
from impactjax._types import Flag, Scalar


class Surface(AbstractTransition):
    """Passage of the surface of the stop: inwards, contact begins; outwards, it ends."""

    wall: Wall
    law: AbstractForceLaw
    guard_stays_zero: ClassVar[bool] = False

    def guard(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
        del model, t
        clearance = self.wall.clearance(y.position)
        inside = mode.at(Phase.CONTACT, self.wall.index) | mode.at(Phase.DETACHED, self.wall.index)
        inactive = jnp.where(inside, -clearance, jnp.ones_like(clearance))
        return jnp.where(mode.phase == Phase.FLIGHT, clearance, inactive)

    def jump(
        self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode, context: Context
    ) -> Jump:
        del t, context
        touches = mode.phase == Phase.FLIGHT
        speed = model.oscillator.lever() * jnp.maximum(-self.wall.sign * y.velocity, 0)
        fresh = self.law.touch(speed, model.oscillator.mass)
        index = self.wall.index
        own = jax.tree.map(lambda new, old: jnp.where(touches, new, old), fresh, y.internal[index])
        internal = (*y.internal[:index], own, *y.internal[index + 1 :])
        place = jnp.broadcast_to(self.wall.place(), jnp.shape(y.position))
        after = Mode(
            jnp.where(touches, Phase.CONTACT, Phase.FLIGHT).astype(jnp.int32),
            jnp.where(touches, index, 0).astype(jnp.int32),
            mode.friction,
        )
        asked = [touches & jnp.isnan(leaf) for leaf in jax.tree.leaves(fresh)]
        in_range = ~jnp.any(jnp.stack([jnp.zeros((), bool), *asked]))
        return Jump(State(place, y.velocity, internal), after, in_range)

    def begins_impact(self, t: Scalar, y: State, mode: Mode) -> Flag:
        del t, y
        return mode.phase == Phase.FLIGHT

    def leaves_stop(self, t: Scalar, y: State, mode: Mode) -> Flag:
        return ~self.begins_impact(t, y, mode)


class PullFree(AbstractTransition):
    """Zero of the contact force inside the indentation: the mass separates or, if it has separated,
    makes contact again.
    """

    wall: Wall
    law: AbstractForceLaw
    guard_stays_zero: ClassVar[bool] = True

    def guard(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
        del t
        force = contact_force(model, self.wall, self.law, y)
        detached = mode.at(Phase.DETACHED, self.wall.index)
        inactive = jnp.where(detached, -force, jnp.ones_like(force))
        return jnp.where(mode.at(Phase.CONTACT, self.wall.index), force, inactive)

    def jump(
        self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode, context: Context
    ) -> Jump:
        del model, context
        pressed = mode.phase == Phase.CONTACT
        phase = jnp.where(pressed, Phase.DETACHED, Phase.CONTACT)
        phase = jnp.where(self.leaves(t, y), Phase.FLIGHT, phase).astype(jnp.int32)
        stop = jnp.where(phase == Phase.FLIGHT, 0, self.wall.index).astype(jnp.int32)
        return Jump(y, Mode(phase, stop, mode.friction), jnp.ones((), bool))

    def begins_impact(self, t: Scalar, y: State, mode: Mode) -> Flag:
        return (mode.phase == Phase.DETACHED) & ~self.leaves(t, y)

    def leaves_stop(self, t: Scalar, y: State, mode: Mode) -> Flag:
        del mode
        return self.leaves(t, y)

    def leaves(self, t: Scalar, y: State) -> Flag:
        """True if the mass passes the surface outwards at this moment.

        A force that vanishes with the penetration is zero there too.
        """
        outwards = self.wall.sign * y.velocity
        passing = outwards * 4 * jnp.finfo(t.dtype).eps * jnp.abs(t)
        return (outwards > 0) & (-self.wall.clearance(y.position) <= passing)
