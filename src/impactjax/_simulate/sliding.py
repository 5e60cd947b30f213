"""Events of resistance: the sliding direction turns, or the mass sticks and slips."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.flow import driven_acceleration, holding_resistance
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.transition import AbstractTransition, Context, Jump
from impactjax._types import Code, Scalar


class Sliding(AbstractTransition):
    """End of sliding at zero velocity, and of sticking when the drive exceeds the resistance."""

    guard_stays_zero: ClassVar[bool] = False

    def guard(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
        drive = driven_acceleration(model, t, y, mode)
        reserve = holding_resistance(model, drive) ** 2 - drive**2
        sliding = mode.friction.astype(y.velocity.dtype) * y.velocity
        active = jnp.where(mode.friction == 0, reserve, sliding)
        moves = (mode.phase != Phase.REST) & (mode.phase != Phase.CHATTER)
        moves = moves & (mode.phase != Phase.SETTLED)
        return jnp.where(moves, active, jnp.ones_like(active))

    def jump(
        self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode, context: Context
    ) -> Jump:
        del context
        after = y._replace(velocity=jnp.zeros_like(y.velocity))
        return Jump(
            after, mode._replace(friction=self.direction(model, t, after, mode)), jnp.ones((), bool)
        )

    def direction(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Code:
        """Sign of the sliding velocity that follows from standing still; 0 if the mass is held."""
        drive = driven_acceleration(model, t, y, mode)
        slipping = mode.friction == 0
        most = holding_resistance(model, drive)
        held = ~slipping & (most > 0) & (jnp.abs(drive) <= most)
        return jnp.where(held, 0, _first_sign(model, t, y, mode)).astype(jnp.int32)


def _first_sign(model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
    """Sign of the drive just after `t`: that of its first derivative that is not zero; 1 if there
    is none.

    Without dry friction a mass stands still where its drive is zero, and leaves as this changes.
    """

    def drive(t: Scalar) -> Scalar:
        return driven_acceleration(model, t, y, mode)

    def rate(t: Scalar) -> Scalar:
        return jax.jvp(drive, (t,), (jnp.ones_like(t),))[1]

    value, slope = drive(t), rate(t)
    _, bend = jax.jvp(rate, (t,), (jnp.ones_like(t),))
    first = jnp.where(value != 0, value, jnp.where(slope != 0, slope, bend))
    return jnp.where(first < 0, -1.0, 1.0)
