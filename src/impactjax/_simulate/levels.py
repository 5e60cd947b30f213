"""Penetration and force of all stops: the levels that are followed along a step."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.law import AbstractForceLaw
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.flow import Wall, contact_force, walls
from impactjax._simulate.state import Mode, State
from impactjax._types import Scalar

Levels = Float[Array, " levels"]  # penetrations of all stops [m], then their forces [N]


@jax.jit  # so that it is traced once
def levels_of(model: ImpactOscillator, t: Scalar, y: State, mode: Mode) -> tuple[Levels, Levels]:
    """Penetration and force of all stops, and their rates along the flow."""
    rate = Automaton(model).flow(t, y, mode)
    return jax.jvp(functools.partial(heights, model), (y,), (rate,))


def chosen(levels: Float[Array, "... levels"], which: Int[Array, "..."]) -> Float[Array, "..."]:
    """One of the levels at each place. By conditions: compilers make little of a gather."""
    found = levels[..., 0]
    for index in range(1, levels.shape[-1]):
        found = jnp.where(which == index, levels[..., index], found)
    return found


def heights(model: ImpactOscillator, y: State) -> Levels:
    lever = model.oscillator.lever()
    penetrations = [-lever * wall.clearance(y.position) for wall in walls(model)]
    forces = [_force(model, wall, y) for wall in walls(model)]
    return jnp.stack([*penetrations, *forces])


def is_compliant(model: ImpactOscillator) -> bool:
    return any(isinstance(wall.stop.law, AbstractForceLaw) for wall in walls(model))


def _force(model: ImpactOscillator, wall: Wall, y: State) -> Scalar:
    law = wall.stop.law
    if isinstance(law, AbstractForceLaw):
        return contact_force(model, wall, law, y)
    return jnp.zeros_like(y.position)
