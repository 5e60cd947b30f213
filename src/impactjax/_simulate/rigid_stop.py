"""Events at a rigid stop: impact, the end of a summed chatter, release from rest."""

from typing import ClassVar

import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractImpactLaw
from impactjax._simulate.chatter import is_summable, push
from impactjax._simulate.flow import Wall, holding_resistance
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.transition import AbstractTransition, Context, Jump
from impactjax._types import Flag, Scalar


def impact_speed(model: ImpactOscillator, approach: Scalar) -> Scalar:
    """Speed of an impact [m/s]; 1 m/s where the mass does not approach, since at 0 the slope of a
    restitution may be infinite.
    """
    meets = approach > 0
    return model.oscillator.lever() * jnp.where(meets, approach, 1.0)


class RigidStop(AbstractTransition):
    """In flight, an impact at zero clearance; at rest, release when the push vanishes.

    A summed chatter ends after a known duration, in rest; its guard is constant.
    """

    wall: Wall
    law: AbstractImpactLaw
    guard_stays_zero: ClassVar[bool] = False

    def guard(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
        holding = self._holding(model, t, y)
        resting = mode.at(Phase.REST, self.wall.index)
        inactive = jnp.where(resting, holding, jnp.ones_like(holding))
        in_flight = mode.phase == Phase.FLIGHT
        return jnp.where(in_flight, self.wall.clearance(y.position), inactive)

    def jump(
        self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode, context: Context
    ) -> Jump:
        flies = mode.phase == Phase.FLIGHT
        approach = -self.wall.sign * y.velocity
        r = self.law.restitution(impact_speed(model, approach))
        velocity = jnp.where(flies, -r * y.velocity, jnp.zeros_like(r))
        place = jnp.broadcast_to(self.wall.place(), jnp.shape(velocity))
        after = State(place, velocity, y.internal)
        in_range = ~flies | (approach <= 0) | ~((r < 0) | (r > 1))
        return Jump(after, self._next_mode(model, t, after, mode, context), in_range)

    def begins_impact(self, t: Scalar, y: State, mode: Mode) -> Flag:
        del t, y
        return mode.phase == Phase.FLIGHT

    def leaves_stop(self, t: Scalar, y: State, mode: Mode) -> Flag:
        return self.begins_impact(t, y, mode)

    def _next_mode(
        self, model: ImpactOscillator, t: Scalar, after: State, before: Mode, context: Context
    ) -> Mode:
        scale, tolerance, chatter = context
        flies = before.phase == Phase.FLIGHT
        summable = flies & is_summable(
            model, self.wall, self.law, t, after, scale, tolerance, chatter
        )
        stays = flies & (after.velocity == 0) & (self._holding(model, t, after) >= 0)
        rests = stays | (before.phase == Phase.CHATTER)
        phase = jnp.where(summable, Phase.CHATTER, jnp.where(rests, Phase.REST, Phase.FLIGHT))
        leaves = phase == Phase.FLIGHT
        return Mode(
            phase.astype(jnp.int32),
            jnp.where(leaves, 0, self.wall.index).astype(jnp.int32),
            jnp.where(leaves, self.wall.sign, 0).astype(jnp.int32),
        )

    def _holding(self, model: ImpactOscillator, t: Scalar, y: State) -> Scalar:
        """Acceleration that keeps a mass at rest on the stop: the push onto it, and resistance."""
        still = jnp.zeros_like(y.velocity)
        return push(model, self.wall, t, still) + holding_resistance(model, still)
