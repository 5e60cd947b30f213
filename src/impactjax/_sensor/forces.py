"""Forces and accelerations at the samples of a trajectory, from the model's own equations."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw, AbstractMemorylessLaw
from impactjax._model.separation import AtZeroForce
from impactjax._simulate.flow import Wall, walls
from impactjax._simulate.trajectory import Trajectory
from impactjax._types import Samples


def contact_force(model: ImpactOscillator, trajectory: Trajectory) -> Samples:
    """Force of the stops on the mass along its coordinate [N].

    The impulse of a rigid stop has no duration, and appears only behind a low-pass; its force on a
    resting mass does. Raises `ValueError` for a law whose force depends on more than penetration
    and rate.
    """
    total = jnp.where(
        _rests(trajectory),
        -inertia(model) * free_acceleration(model, trajectory),
        jnp.zeros_like(trajectory.ts),
    )
    for wall in walls(model):
        law = wall.stop.law
        if isinstance(law, AbstractForceLaw):
            total = total + wall.sign * _pushes(model, wall, law, trajectory)
    return total


def acceleration(model: ImpactOscillator, trajectory: Trajectory) -> Samples:
    """Second derivative of the coordinate [rad/s²] or [m/s²]."""
    free = free_acceleration(model, trajectory)
    driven = free + contact_force(model, trajectory) / inertia(model)
    velocity = trajectory.velocity
    resistance = model.oscillator.resistance(jnp.abs(velocity))
    if resistance is None:
        return driven
    held = (velocity == 0) & (jnp.abs(driven) <= resistance)
    return jnp.where(held, 0.0, driven - jnp.sign(velocity) * resistance)


def proper_acceleration(model: ImpactOscillator, trajectory: Trajectory) -> Samples:
    """Proper acceleration, as of an accelerometer on the mass: contact and drag force divided by
    the mass [m/s²]. Zero in free fall, upwards positive.
    """
    felt = acceleration(model, trajectory) - free_acceleration(model, trajectory)
    return model.oscillator.lever() * felt


def slopes(ts: Samples, values: Samples) -> Samples:
    """Time derivative of samples, by differences of second order."""
    if ts.shape[0] < 2:
        return jnp.zeros_like(values)
    between = jnp.diff(values) / jnp.diff(ts)
    middle = (between[1:] + between[:-1]) / 2
    return jnp.concatenate([between[:1], middle, between[-1:]])


def inertia(model: ImpactOscillator) -> Float[Array, "..."]:
    """Force by acceleration of the coordinate: mass times lever."""
    return model.oscillator.mass * model.oscillator.lever()


def free_acceleration(model: ImpactOscillator, trajectory: Trajectory) -> Samples:
    """Acceleration without contact and resistance [rad/s²] or [m/s²]."""
    free = model.oscillator.acceleration(trajectory.ts, trajectory.position, trajectory.velocity)
    return jnp.broadcast_to(free, trajectory.ts.shape)


def _pushes(
    model: ImpactOscillator, wall: Wall, law: AbstractForceLaw, trajectory: Trajectory
) -> Samples:
    """Force [N] of a compliant stop, positive when it pushes the mass off."""
    if not isinstance(law, AbstractMemorylessLaw):
        raise ValueError(
            f"The force of {type(law).__name__} depends on more than penetration and rate; a "
            "record of force or acceleration cannot be fitted with it."
        )
    lever, mass = model.oscillator.lever(), model.oscillator.mass
    penetration = -lever * jax.vmap(wall.clearance)(trajectory.position)
    touches = penetration > 0
    depth = jnp.where(touches, penetration, 1.0)
    rate = -lever * wall.sign * trajectory.velocity
    force = jax.vmap(lambda d, v: law.force(d, v, (), mass))(depth, rate)
    if isinstance(law.separation, AtZeroForce):
        force = jnp.maximum(force, 0.0)
    return jnp.where(touches, force, 0.0)


def _rests(trajectory: Trajectory) -> Bool[Array, " samples"]:
    """Mask of the samples at which the mass rests on a rigid stop."""
    rests, ts = trajectory.rests, trajectory.ts[:, None]
    happened = jnp.arange(rests.begin.shape[-1], dtype=rests.count.dtype) < rests.count
    lasts = (ts < rests.end) | ~rests.released
    return jnp.any(happened & (rests.begin <= ts) & lasts, axis=1)
