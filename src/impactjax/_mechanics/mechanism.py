"""The interface of a mechanism: several coordinates, and stops between its parts."""

import abc
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from impactjax._model.law import AbstractLaw
from impactjax._types import Scalar

Coordinates: TypeAlias = Float[Array, " coordinates"]
Matrix: TypeAlias = Float[Array, "coordinates coordinates"]


class Contact(NamedTuple):
    """A stop between two parts of a mechanism, or between a part and the ground.

    - `gap`: distance [m] as a smooth function of the coordinates; negative in penetration.
    - `law`: the contact law. It sees the effective mass 1/(nᵀ M⁻¹ n) with n = ∂gap/∂q.
    """

    gap: Callable[[Coordinates], ArrayLike]
    law: AbstractLaw


class Friction(NamedTuple):
    """Dry friction between two parts of a mechanism, or between a part and the ground.

    Coulomb's law: |F| ≤ `force` while the parts stick, F = −`force` sgn ṡ while they slip. The
    generalised force is F ∂s/∂q.

    - `slip`: displacement s [m], or angle [rad], of one part along the other, as a smooth function
      of the coordinates; only its rate matters.
    - `force`: the largest force [N], or torque [N m], at least 0.
    """

    slip: Callable[[Coordinates], ArrayLike]
    force: ArrayLike


class AbstractMechanism(eqx.Module):
    """A mechanism with the equations of motion d/dt ∂T/∂v − ∂T/∂q + ∂V/∂q = Q, where
    T = ½ vᵀ M(q) v.

    Fields are parameters. Coordinates are in m or rad, so that gaps are in m.
    """

    @abc.abstractmethod
    def mass_matrix(self, q: Coordinates) -> Matrix:
        """The mass matrix M(q), symmetric and positive."""

    @abc.abstractmethod
    def potential(self, t: Scalar, q: Coordinates) -> ArrayLike:
        """The potential energy V(t, q) [J]."""

    @abc.abstractmethod
    def force(self, t: Scalar, q: Coordinates, v: Coordinates) -> Coordinates:
        """All further generalised forces Q(t, q, v), such as damping; zeros if there are none."""

    def smooth_until(self, t: Scalar) -> Scalar | None:
        """The next time at which potential or forces are not smooth; `None` if there is none."""
        del t

    @abc.abstractmethod
    def contacts(self) -> Sequence[Contact]:
        """The stops."""

    def friction(self) -> Sequence[Friction]:
        """The places with dry friction; none if left out."""
        return ()


def energy(mechanism: AbstractMechanism, t: Scalar, q: Coordinates, v: Coordinates) -> Scalar:
    """Kinetic and potential energy [J], without that of contacts."""
    kinetic = v @ mechanism.mass_matrix(q) @ v / 2
    return kinetic + jnp.asarray(mechanism.potential(t, q))


def momentum_rate(
    mechanism: AbstractMechanism, t: Scalar, q: Coordinates, v: Coordinates
) -> Coordinates:
    """M(q) v̇ without contact: Q − ∂V/∂q + ∂T/∂q − Ṁ v."""

    def momentum(q: Coordinates) -> Coordinates:
        return mechanism.mass_matrix(q) @ v

    def lagrangian(q: Coordinates) -> Scalar:
        return v @ momentum(q) / 2 - jnp.asarray(mechanism.potential(t, q))

    _, change = jax.jvp(momentum, (q,), (v,))
    return mechanism.force(t, q, v) + jax.grad(lagrangian)(q) - change


def gaps(mechanism: AbstractMechanism, q: Coordinates) -> Float[Array, " contacts"]:
    """The gap of each contact [m]."""
    found = [jnp.asarray(each.gap(q), q.dtype) for each in mechanism.contacts()]
    return jnp.stack(found) if found else jnp.zeros(0, q.dtype)


def normals(mechanism: AbstractMechanism, q: Coordinates) -> Float[Array, "places coordinates"]:
    """The gradient of each gap, and after them that of each slip."""
    lengths = [each.gap for each in mechanism.contacts()]
    lengths += [each.slip for each in mechanism.friction()]
    return jnp.stack([jax.grad(lambda q, own=own: jnp.asarray(own(q)))(q) for own in lengths])
