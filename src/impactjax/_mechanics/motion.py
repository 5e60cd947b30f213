"""Acceleration of a mechanism with contact forces, friction, and what rests or sticks."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import jax.scipy as jsp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from impactjax._mechanics.mechanism import (
    AbstractMechanism,
    Coordinates,
    gaps,
    momentum_rate,
    normals,
)
from impactjax._model.law import AbstractForceLaw, Internal
from impactjax._types import Scalar

FREE, TOUCHING, DETACHED, RESTING = range(4)  # phases of a contact
STICKING = 0  # phase of a friction; ±1 is the direction of slip


class MechanicalState(NamedTuple):
    """State of a mechanism.

    - `q`, `v`: coordinates and their rates.
    - `internal`: internal state of each contact's law; `()` for those without one.
    """

    q: Coordinates
    v: Coordinates
    internal: tuple[Internal, ...]


Phases = Int[Array, " places"]
AtPlaces = Float[Array, " places"]
Mask = Bool[Array, " places"]


class Geometry(NamedTuple):
    """Contacts, and after them the places of friction, at a position.

    - `gap`: distances of the contacts [m].
    - `rate`: rates of gaps and slips [m/s].
    - `normals`: gradients of gaps and slips.
    - `mobility`: M⁻¹ nᵀ, a column for each.
    - `compliance`: n M⁻¹ nᵀ [1/kg]; the inverse of its diagonal holds the effective masses.
    """

    gap: Float[Array, " contacts"]
    rate: AtPlaces
    normals: Float[Array, "places coordinates"]
    mobility: Float[Array, "coordinates places"]
    compliance: Float[Array, "places places"]


class Motion(NamedTuple):
    """Acceleration, and the forces with which it goes.

    - `acceleration`: v̇.
    - `kept`: the part of it by the forces that keep contacts closed and frictions sticking.
    - `push`: force [N] of each contact, by its law or what keeps a resting one closed, and of each
      friction, by Coulomb's law or what keeps it sticking.
    """

    acceleration: Coordinates
    kept: Coordinates
    push: AtPlaces


def geometry(mechanism: AbstractMechanism, y: MechanicalState) -> Geometry:
    """The places of a mechanism that has some."""
    return _geometry(mechanism, y, jnp.zeros_like(y.q))[0]


def _geometry(
    mechanism: AbstractMechanism, y: MechanicalState, force: Coordinates
) -> tuple[Geometry, Coordinates]:
    """The places, and the acceleration by a force, with one factorisation of the mass matrix."""
    directions = normals(mechanism, y.q)
    columns = jnp.concatenate([directions.T, force[:, None]], axis=1)
    solved = _divided(columns, mechanism.mass_matrix(y.q))
    mobility, acceleration = solved[:, :-1], solved[:, -1]
    compliance = directions @ mobility
    gap = gaps(mechanism, y.q)
    return Geometry(gap, directions @ y.v, directions, mobility, compliance), acceleration


def motion(mechanism: AbstractMechanism, t: Scalar, y: MechanicalState, phases: Phases) -> Motion:
    """Acceleration and forces in given phases.

    Forces of touching contacts and slipping frictions follow from their laws. Those that hold, λ,
    keep gaps closed and slips constant: n v̇ + ṅ v = 0.
    """
    force = momentum_rate(mechanism, t, y.q, y.v)
    contacts, frictions = mechanism.contacts(), mechanism.friction()
    if not contacts and not frictions:
        free = _divided(force, mechanism.mass_matrix(y.q))
        return Motion(free, jnp.zeros_like(free), jnp.zeros(0, t.dtype))
    place, free = _geometry(mechanism, y, force)
    laws = [_law_force(each.law, number, place, y, phases) for number, each in enumerate(contacts)]
    resists = [
        -limit * phases[number].astype(t.dtype)
        for number, limit in enumerate(limits(mechanism, t), start=len(contacts))
    ]
    push = jnp.stack([*laws, *resists])
    free = free + place.mobility @ push
    if not frictions and all(not each.law.is_rigid() for each in contacts):
        return Motion(free, jnp.zeros_like(free), push)
    _, turning = jax.jvp(lambda q: normals(mechanism, q), (y.q,), (y.v,))
    held = is_held(mechanism, phases)
    keeping = closing(place, held, -(place.normals @ free + turning @ y.v))
    kept = place.mobility @ keeping
    return Motion(free + kept, kept, push + keeping)


def limits(mechanism: AbstractMechanism, like: Scalar) -> list[Scalar]:
    """The largest force of each friction; NaN for one that is negative."""
    found = [jnp.asarray(each.force, like.dtype) for each in mechanism.friction()]
    return [jnp.where(limit >= 0, limit, jnp.nan) for limit in found]


def is_held(mechanism: AbstractMechanism, phases: Phases) -> Mask:
    """True for resting contacts and sticking frictions."""
    holding = np.full(phases.size, STICKING, np.int32)
    holding[: len(mechanism.contacts())] = RESTING
    return phases == holding


def with_phase(phases: Phases, number: int, phase: ArrayLike) -> Phases:
    """Phases with that of one place replaced."""
    here = jnp.arange(phases.size, dtype=jnp.int32) == number
    return jnp.where(here, jnp.asarray(phase, phases.dtype), phases)


def closing(place: Geometry, held: Mask, wanted: AtPlaces) -> AtPlaces:
    """Forces or impulses of the held places that change their rates by `wanted`; zero for all
    others.
    """
    if held.size == 1:
        return jnp.where(held, wanted / place.compliance[0], jnp.zeros_like(wanted))
    both = held[:, None] & held[None, :]
    matrix = jnp.where(both, place.compliance, jnp.eye(held.size, dtype=wanted.dtype))
    return _divided(jnp.where(held, wanted, jnp.zeros_like(wanted)), matrix)


def _divided(right: Array, matrix: Array) -> Array:
    """The solution x of A x = b with a symmetric positive matrix A."""
    return jsp.linalg.solve(matrix, right, assume_a="pos")


def _law_force(
    law: object, number: int, place: Geometry, y: MechanicalState, phases: Phases
) -> Scalar:
    if not isinstance(law, AbstractForceLaw):
        return jnp.zeros_like(place.gap[number])
    mass = 1 / place.compliance[number, number]
    force = law.force(-place.gap[number], -place.rate[number], y.internal[number], mass)
    return jnp.where(phases[number] == TOUCHING, force, jnp.zeros_like(force))


def internal_rates(
    mechanism: AbstractMechanism, y: MechanicalState, phases: Phases
) -> tuple[Internal, ...]:
    """Rate of each law's internal state."""
    contacts = mechanism.contacts()
    if not jax.tree.leaves(y.internal):
        return y.internal
    place, rates = geometry(mechanism, y), []
    for number, each in enumerate(contacts):
        internal = y.internal[number]
        if not isinstance(each.law, AbstractForceLaw) or not jax.tree.leaves(internal):
            rates.append(internal)
            continue
        mass = 1 / place.compliance[number, number]
        change = each.law.internal_rate(-place.gap[number], -place.rate[number], internal, mass)
        touching = phases[number] == TOUCHING
        rates.append(
            jax.tree.map(lambda x, on=touching: jnp.where(on, x, jnp.zeros_like(x)), change)
        )
    return tuple(rates)
