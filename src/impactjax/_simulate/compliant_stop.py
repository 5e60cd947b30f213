"""Events at a compliant stop: touch and separation."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._model.separation import AtZeroForce
from impactjax._simulate.flow import Wall, contact_force
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.transition import AbstractTransition, Context, Jump
from impactjax._types import Scalar


class Surface(AbstractTransition):
    """The mass passes the place of the stop: inwards, contact begins; outwards, it is free."""

    wall: Wall
    law: AbstractForceLaw
    guard_stays_zero: ClassVar[bool] = False

    def guard(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
        del model, t
        clearance = self.wall.clearance(y.position)
        leaves_at_surface = (
            Phase.DETACHED if isinstance(self.law.separation, AtZeroForce) else Phase.CONTACT
        )
        inside = mode.at(leaves_at_surface, self.wall.index)
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
        return Jump(State(place, y.velocity, internal), after, jnp.ones((), bool))


class PullFree(AbstractTransition):
    """The contact force falls to zero: the mass separates inside the indentation, or, if it has
    separated, comes to press again.
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
        del model, t, context
        pressed = mode.phase == Phase.CONTACT
        phase = jnp.where(pressed, Phase.DETACHED, Phase.CONTACT).astype(jnp.int32)
        return Jump(y, mode._replace(phase=phase), jnp.ones((), bool))
