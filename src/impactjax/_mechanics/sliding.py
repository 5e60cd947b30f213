"""Stick and slip of the frictions of a mechanism."""

import jax.numpy as jnp
from jaxtyping import Array, Int

from impactjax._hybrid.system import Transition
from impactjax._mechanics.mechanism import AbstractMechanism
from impactjax._mechanics.motion import (
    RESTING,
    STICKING,
    Geometry,
    MechanicalState,
    Phases,
    closing,
    geometry,
    is_held,
    limits,
    motion,
    with_phase,
)
from impactjax._types import Code, Scalar

_PARALLEL = 1e-9  # difference of two directions that are the same


def sliding(mechanism: AbstractMechanism, number: int) -> Transition:
    """The end of a slip, in stick or in the opposite slip, and the end of a stick."""
    contacts = len(mechanism.contacts())
    own = contacts + number

    def guard(t: Scalar, y: MechanicalState, mode: Phases) -> Scalar:
        place = geometry(mechanism, y)
        push, limit = motion(mechanism, t, y, mode).push[own], limits(mechanism, t)[number]
        slips = mode[own].astype(t.dtype) * place.rate[own]
        active = jnp.where(mode[own] == STICKING, limit**2 - push**2, slips)
        return jnp.where(blocked(place, mode)[own] == 0, active, jnp.ones_like(active))

    def jump(t: Scalar, y: MechanicalState, mode: Phases) -> tuple[MechanicalState, Phases]:
        sticks = with_phase(mode, own, STICKING)
        place = geometry(mechanism, y)
        stopped = y.v + place.mobility @ closing(place, is_held(mechanism, sticks), -place.rate)
        turned = after_stop(mechanism, t, y, mode, number)
        after = with_phase(mode, own, turned)
        return y._replace(v=jnp.where(turned == STICKING, stopped, y.v)), after

    return Transition(guard, jump)


def after_stop(
    mechanism: AbstractMechanism, t: Scalar, y: MechanicalState, mode: Phases, number: int
) -> Code:
    """Phase of a friction at rest: it sticks if it was slipping and its limit is not exceeded;
    otherwise it slips as it is driven.
    """
    own = len(mechanism.contacts()) + number
    needed = motion(mechanism, t, y, with_phase(mode, own, STICKING)).push[own]
    sticks = (mode[own] != STICKING) & (jnp.abs(needed) < limits(mechanism, t)[number])
    return jnp.where(sticks, STICKING, jnp.where(needed > 0, -1, 1)).astype(jnp.int32)


def after_impact(
    mechanism: AbstractMechanism, place: Geometry, change: Array, mode: Phases, moved: Array
) -> Phases:
    """Phases after an impact that has changed the rates v by `change`.

    What it has moved is no longer at rest, and slips as it moves. Friction has no impulse.
    """
    slips = jnp.sign(place.rate + place.normals @ change).astype(jnp.int32)
    freed = jnp.where(mode == RESTING, jnp.zeros_like(mode), mode)
    is_friction = jnp.arange(mode.size, dtype=jnp.int32) >= len(mechanism.contacts())
    return jnp.where(moved, jnp.where(is_friction, slips, freed), mode)


def blocked(place: Geometry, mode: Phases) -> Int[Array, " places"]:
    """For each friction that a resting contact holds at rest the direction in which it will slip
    when the contact opens; 0 for all others, and for contacts.
    """
    count = place.gap.size
    if count == 0:
        return jnp.zeros_like(mode)
    sizes = jnp.diagonal(place.compliance)
    cross = place.compliance[:, :count]
    same = cross**2 >= (1 - _PARALLEL) * sizes[:, None] * sizes[:count]
    along = jnp.where(same & (mode[:count] == RESTING), jnp.sign(cross), 0.0)
    is_friction = jnp.arange(mode.size, dtype=jnp.int32) >= count
    return jnp.where(is_friction, jnp.sign(jnp.sum(along, axis=1)), 0.0).astype(jnp.int32)
