"""The end of the motion in a compliant stop that catches the mass.

Under a constant push the mass comes to rest in the indentation, but a stiff contact would still
require short steps. Once all remaining motion is below the error allowed, the mass is held.
"""

from typing import ClassVar

import jax
import jax.numpy as jnp

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.driving import is_driven
from impactjax._simulate.flow import flow, unheld_acceleration, walls
from impactjax._simulate.state import Mode, Phase, State
from impactjax._simulate.transition import AbstractTransition, Context, Jump
from impactjax._types import Flag, Scalar

_UNSEEN = 1e-3  # largest remaining motion, as a fraction of the error allowed
_INSIDE = 1e-2  # largest remaining motion, as a fraction of the penetration


class Settling(AbstractTransition):
    """Permanent rest of the mass in a compliant stop.

    It happens at the end of a step if `is_settled` is true.
    """

    guard_stays_zero: ClassVar[bool] = False

    def guard(self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> None:
        del model, t, y, mode

    def jump(
        self, model: ImpactOscillator, t: Scalar, y: State, mode: Mode, context: Context
    ) -> Jump:
        del model, t, context
        after = y._replace(velocity=jnp.zeros_like(y.velocity))
        settled = mode._replace(phase=jnp.int32(Phase.SETTLED))
        return Jump(after, settled, jnp.ones((), bool))


def is_settled(
    model: ImpactOscillator,
    t: Scalar,
    y: State,
    mode: Mode,
    begin: Scalar,
    tolerance: Scalar,
    way: Scalar,
    speed: Scalar,
) -> Flag:
    """True if all motion after `t` of a run since `begin` leaves the mass in contact and is small
    compared with the error allowed, `tolerance` times the largest way and speed so far. Never if
    time enters the equation of motion.

    Near its equilibrium the mass moves by x″ + c x′ + s x = 0, and so at most |x′|/κ + |x″|/κ² from
    its position, with the slower of its rates, κ = min(√s, s/c). A disturbance of the initial state
    must have decayed too, by exp(−κ′ (t − t₀)) with κ′ = min(c/2, s/c). This is a condition of its
    own for a mass that starts in equilibrium.
    """

    def acceleration(position: Scalar, velocity: Scalar) -> Scalar:
        moved = y._replace(position=position, velocity=velocity)
        return unheld_acceleration(model, t, moved, mode)

    if is_driven(model):
        return jnp.zeros((), bool)
    here, one, zero = (y.position, y.velocity), jnp.ones_like(t), jnp.zeros_like(t)
    rate, fall = jax.jvp(acceleration, here, (one, zero))
    _, drop = jax.jvp(acceleration, here, (zero, one))
    restores = (fall < 0) & (drop <= 0) & jnp.isfinite(drop)
    stiffness, damping = jnp.where(restores, -fall, 1.0), jnp.where(restores, -drop, 0.0)
    creep = jnp.where(damping > 0, stiffness / jnp.where(damping > 0, damping, 1.0), jnp.inf)
    slow = jnp.minimum(jnp.sqrt(stiffness), creep)
    faded = jnp.minimum(damping / 2, creep) * (t - begin) >= -jnp.log(_UNSEEN * tolerance)
    left = jnp.abs(y.velocity) / slow + jnp.abs(rate) / slow**2
    penetrations = [
        jnp.where(mode.at(Phase.CONTACT, wall.index), -wall.clearance(y.position), 0)
        for wall in walls(model)
    ]
    conditions = [
        restores & faded,
        left <= _INSIDE * sum(penetrations),
        left <= _UNSEEN * tolerance * way,
        slow * left <= _UNSEEN * tolerance * speed,
        *(change == 0 for change in jax.tree.leaves(flow(model, t, y, mode).internal)),
    ]
    return jnp.all(jnp.stack(conditions))
