"""The impact oscillator as a mechanism of one coordinate."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike

from impactjax._mechanics.mechanism import (
    AbstractMechanism,
    Contact,
    Coordinates,
    Friction,
    Matrix,
)
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.oscillator import AbstractOscillator
from impactjax._model.stop import Stop
from impactjax._refusal import of_kind
from impactjax._types import Scalar


class OscillatorMechanism(AbstractMechanism):
    """An impact oscillator as a mechanism, for periodic orbits, branches, exponents and sections.

    With the lever ℓ its inertia is m ℓ², and the gaps of its stops are ℓ (gap ± q). All forces are
    generalised forces, so that its potential is zero. `simulate` is faster for plain runs.

    **Arguments:**

    - `model`: the oscillator and its stops.
    """

    model: ImpactOscillator = eqx.field(
        converter=of_kind("model", ImpactOscillator, "ImpactOscillator(Pendulum(13.0))")
    )

    def mass_matrix(self, q: Coordinates) -> Matrix:
        return jnp.full((1, 1), self._inertia(), q.dtype)

    def potential(self, t: Scalar, q: Coordinates) -> ArrayLike:
        del t
        return jnp.zeros((), q.dtype)

    def force(self, t: Scalar, q: Coordinates, v: Coordinates) -> Coordinates:
        oscillator = self.model.oscillator
        acceleration = jnp.asarray(oscillator.acceleration(t, q[0], v[0]), q.dtype)
        drag = oscillator.resistance(jnp.abs(v[0]))
        if drag is not None:
            acceleration = acceleration - (drag - _holding(oscillator)) * jnp.sign(v[0])
        return self._inertia() * acceleration[None]

    def smooth_until(self, t: Scalar) -> Scalar | None:
        return self.model.oscillator.smooth_until(t)

    def contacts(self) -> Sequence[Contact]:
        placed = [(1, self.model.lower), (-1, self.model.upper)]
        return [self._contact(sign, stop) for sign, stop in placed if stop is not None]

    def friction(self) -> Sequence[Friction]:
        oscillator = self.model.oscillator
        if oscillator.resistance(jnp.zeros(())) is None:
            return ()
        return (Friction(lambda q: q[0], self._inertia() * _holding(oscillator)),)

    def _inertia(self) -> Scalar:
        return self.model.oscillator.mass * jnp.asarray(self.model.oscillator.lever()) ** 2

    def _contact(self, sign: int, stop: Stop) -> Contact:
        lever = self.model.oscillator.lever()
        return Contact(lambda q: lever * (sign * q[0] + stop.gap), stop.law)


def _holding(oscillator: AbstractOscillator) -> Scalar:
    """The greatest acceleration against which a mass at rest sticks."""
    return jnp.asarray(oscillator.resistance(jnp.zeros_like(oscillator.mass)))
