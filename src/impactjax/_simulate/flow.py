"""The flow of each mode: y′ = f(t, y)."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._model.stop import Stop
from impactjax._simulate.state import Mode, Phase, State
from impactjax._types import Flag, Scalar


class Wall(eqx.Module):
    """A stop with its side: `sign` is the direction in which it pushes."""

    index: int = eqx.field(static=True)
    sign: int = eqx.field(static=True)
    stop: Stop

    def place(self) -> Scalar:
        """The coordinate at which the stop stands."""
        return -self.sign * self.stop.gap

    def clearance(self, position: Scalar) -> Scalar:
        """Distance to the stop in units of the coordinate, positive on the free side."""
        return self.sign * position + self.stop.gap


def walls(model: ImpactOscillator) -> tuple[Wall, ...]:
    """The stops of a model, numbered."""
    placed = [(1, model.lower), (-1, model.upper)]
    present = [(sign, stop) for sign, stop in placed if stop is not None]
    return tuple(Wall(index, sign, stop) for index, (sign, stop) in enumerate(present))


def free_acceleration(model: ImpactOscillator, t: Scalar, y: State) -> Scalar:
    """Acceleration of the oscillator alone, without resistance."""
    acceleration = model.oscillator.acceleration(t, y.position, y.velocity)
    return jnp.asarray(acceleration, jnp.result_type(y.position))


def _penetration(model: ImpactOscillator, wall: Wall, y: State) -> tuple[Scalar, Scalar]:
    """Penetration of a stop [m], and its rate [m/s].

    The sign is changed last, so that with a lever of 1 the compiler can share a sine of the
    clearance with the oscillator.
    """
    lever = model.oscillator.lever()
    return -(lever * wall.clearance(y.position)), -(lever * (wall.sign * y.velocity))


def contact_force(model: ImpactOscillator, wall: Wall, law: AbstractForceLaw, y: State) -> Scalar:
    """Force [N] of a compliant stop, positive when it pushes the mass off."""
    internal, mass = y.internal[wall.index], model.oscillator.mass
    return law.force(*_penetration(model, wall, y), internal, mass)


def driven_acceleration(model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
    """Acceleration by all forces except resistance, including contact."""
    acceleration = free_acceleration(model, t, y)
    inertia = model.oscillator.mass * model.oscillator.lever()
    for wall in walls(model):
        if isinstance(wall.stop.law, AbstractForceLaw):
            push = wall.sign * contact_force(model, wall, wall.stop.law, y) / inertia
            touching = mode.at(Phase.CONTACT, wall.index)
            acceleration = acceleration + jnp.where(touching, push, jnp.zeros_like(push))
    return acceleration


def has_resistance(model: ImpactOscillator) -> bool:
    """True if the oscillator has a resistance, such as dry friction or drag."""
    return model.oscillator.resistance(jnp.zeros(())) is not None


def holding_resistance(model: ImpactOscillator, like: Scalar) -> Scalar:
    """The greatest acceleration against which a mass at rest sticks; zero without friction."""
    resistance = model.oscillator.resistance(jnp.zeros_like(like))
    return jnp.zeros_like(like) if resistance is None else resistance


def is_held(model: ImpactOscillator, mode: Mode) -> Flag:
    """True if the mass is at rest: on or in a stop, or held by dry friction."""
    held = (mode.phase == Phase.REST) | (mode.phase == Phase.SETTLED)
    if has_resistance(model):
        held = held | (mode.friction == 0)
    return held


def unheld_acceleration(model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> Scalar:
    """Acceleration, resistance included, if neither stop nor friction held the mass."""
    acceleration = driven_acceleration(model, t, y, mode)
    sliding = mode.friction.astype(acceleration.dtype)
    resistance = model.oscillator.resistance(sliding * y.velocity)
    return acceleration if resistance is None else acceleration - sliding * resistance


def flow(model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> State:
    """Time derivative of the state in a mode. Not for `Phase.CHATTER`, which has a closed form."""
    acceleration = unheld_acceleration(model, t, y, mode)
    held = is_held(model, mode)
    still = jnp.zeros_like(acceleration)
    return State(
        jnp.where(held, still, y.velocity),
        jnp.where(held, still, acceleration),
        _internal_rates(model, y, mode),
    )


def _internal_rates(model: ImpactOscillator, y: State, mode: Mode) -> tuple[PyTree, ...]:
    mass = model.oscillator.mass
    rates = []
    for wall in walls(model):
        law = wall.stop.law
        if not isinstance(law, AbstractForceLaw):
            rates.append(())
            continue
        internal = y.internal[wall.index]
        change = law.internal_rate(*_penetration(model, wall, y), internal, mass)
        touching = mode.at(Phase.CONTACT, wall.index)
        rates.append(
            jax.tree.map(lambda x, on=touching: jnp.where(on, x, jnp.zeros_like(x)), change)
        )
    return tuple(rates)
