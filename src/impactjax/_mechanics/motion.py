"""Acceleration of a mechanism with contact forces and resting contacts."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import jax.scipy as jsp
from jaxtyping import Array, Bool, Float, Int

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


class MechanicalState(NamedTuple):
    """State of a mechanism.

    - `q`, `v`: coordinates and their rates.
    - `internal`: internal state of each contact's law; `()` for those without one.
    """

    q: Coordinates
    v: Coordinates
    internal: tuple[Internal, ...]


Phases = Int[Array, " contacts"]


class Geometry(NamedTuple):
    """Contacts at a position.

    - `gap`, `rate`: distances [m] and their rates [m/s].
    - `normals`: gradients of the gaps.
    - `mobility`: M⁻¹ nᵀ, a column for each contact.
    - `compliance`: n M⁻¹ nᵀ [1/kg]; the inverse of its diagonal holds the effective masses.
    """

    gap: Float[Array, " contacts"]
    rate: Float[Array, " contacts"]
    normals: Float[Array, "contacts coordinates"]
    mobility: Float[Array, "coordinates contacts"]
    compliance: Float[Array, "contacts contacts"]


class Motion(NamedTuple):
    """Acceleration, and the contact forces with which it goes.

    - `acceleration`: v̇.
    - `kept`: the part of it by the forces that keep resting contacts closed.
    - `push`: force [N] of each contact: by its law, or what keeps a resting contact closed.
    """

    acceleration: Coordinates
    kept: Coordinates
    push: Float[Array, " contacts"]


def geometry(mechanism: AbstractMechanism, y: MechanicalState) -> Geometry:
    """The contacts of a mechanism that has some."""
    return _geometry(mechanism, y, jnp.zeros_like(y.q))[0]


def _geometry(
    mechanism: AbstractMechanism, y: MechanicalState, force: Coordinates
) -> tuple[Geometry, Coordinates]:
    """The contacts, and the acceleration by a force, with one factorisation of the mass matrix."""
    contacts = mechanism.contacts()
    directions = normals(contacts, y.q)
    columns = jnp.concatenate([directions.T, force[:, None]], axis=1)
    solved = _divided(columns, mechanism.mass_matrix(y.q))
    mobility, acceleration = solved[:, :-1], solved[:, -1]
    compliance = directions @ mobility
    gap = gaps(contacts, y.q)
    return Geometry(gap, directions @ y.v, directions, mobility, compliance), acceleration


def motion(mechanism: AbstractMechanism, t: Scalar, y: MechanicalState, phases: Phases) -> Motion:
    """Acceleration and contact forces in given phases.

    Forces F of touching contacts follow from their laws. Those of resting contacts, λ, keep their
    gaps closed: n v̇ + ṅ v = 0.
    """
    force = momentum_rate(mechanism, t, y.q, y.v)
    contacts = mechanism.contacts()
    if not contacts:
        free = _divided(force, mechanism.mass_matrix(y.q))
        return Motion(free, jnp.zeros_like(free), jnp.zeros(0, t.dtype))
    place, free = _geometry(mechanism, y, force)
    push = jnp.stack(
        [_law_force(each.law, number, place, y, phases) for number, each in enumerate(contacts)]
    )
    free = free + place.mobility @ push
    if all(not each.law.is_rigid() for each in contacts):
        return Motion(free, jnp.zeros_like(free), push)
    _, turning = jax.jvp(lambda q: normals(contacts, q), (y.q,), (y.v,))
    keeping = closing(place, phases == RESTING, -(place.normals @ free + turning @ y.v))
    kept = place.mobility @ keeping
    return Motion(free + kept, kept, push + keeping)


def closing(
    place: Geometry, resting: Bool[Array, " contacts"], wanted: Float[Array, " contacts"]
) -> Float[Array, " contacts"]:
    """Forces or impulses of the resting contacts that change the rates of their gaps by `wanted`;
    zero for all others.
    """
    if resting.size == 1:
        return jnp.where(resting, wanted / place.compliance[0], jnp.zeros_like(wanted))
    both = resting[:, None] & resting[None, :]
    matrix = jnp.where(both, place.compliance, jnp.eye(resting.size, dtype=wanted.dtype))
    return _divided(jnp.where(resting, wanted, jnp.zeros_like(wanted)), matrix)


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
