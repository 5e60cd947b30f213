"""Stages of a Runge-Kutta step, denser towards the surface of a compliant stop."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array

from impactjax._simulate.automaton import Automaton
from impactjax._simulate.compliant_stop import Surface
from impactjax._simulate.state import Mode, Phase, State
from impactjax._types import Code, Scalar


class Grading(NamedTuple):
    """Flags, as numbers, of a step that begins or ends at the surface of a compliant stop.

    The force grows with a broken power of the time there. With the time t + h σ² at the stage σ,
    or t + h (1 − (1 − σ)²), δ^{3/2} is smooth in σ, and infinite slopes have the weight zero.
    """

    begins: Scalar
    ends: Scalar

    def weight(self, sigma: Scalar) -> Scalar:
        """The derivative by σ of the share of the step's duration that has passed."""
        early, late = 2 * sigma, 2 * (1 - sigma)
        return jnp.where(self.begins > 0, early, jnp.where(self.ends > 0, late, 1.0))

    def stage(self, sigma: Scalar, rates: list[Array]) -> list[Array]:
        """The derivatives by σ, over h, from those by time."""
        weight = self.weight(sigma)
        return [jnp.where(weight > 0, weight * rate, 0.0) for rate in rates]

    def share(self, sigma: Scalar) -> Scalar:
        """The share of the step's duration that has passed at the stage σ."""
        early, late = sigma**2, sigma * (2 - sigma)
        return jnp.where(self.begins > 0, early, jnp.where(self.ends > 0, late, sigma))

    def sigma(self, share: Scalar) -> Scalar:
        """The stage σ at which a share of the step's duration has passed."""
        early, late = _root(share), 1 - _root(1 - share)
        return jnp.where(self.begins > 0, early, jnp.where(self.ends > 0, late, share))


def _root(share: Scalar) -> Scalar:
    """The square root; zero, with a derivative of zero, of what is not positive."""
    positive = share > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, share, 1.0)), 0.0)


def grading_of(automaton: Automaton, y: State, mode: Mode, event: Code) -> Grading:
    """The grading of a step from `y` that is to end on `event`.

    A step that ends at a turn, or inside the indentation, has a smooth force there.
    """
    begins = ends = jnp.zeros((), bool)
    for index, each in enumerate(automaton.transitions):
        if isinstance(each, Surface):
            here = mode.at(Phase.CONTACT, each.wall.index)
            begins = begins | (here & (y.position == each.wall.place()))
            ends = ends | (here & (event == index))
    flags = begins, ends
    return Grading(*(jax.lax.stop_gradient(flag.astype(y.position.dtype)) for flag in flags))


def time_to_surface(automaton: Automaton, y: State, mode: Mode) -> Scalar:
    """The time until a mass in a compliant stop is back at its surface, at its present velocity;
    infinite if it moves inwards.
    """
    time = jnp.full_like(y.position, jnp.inf)
    for each in automaton.transitions:
        if isinstance(each, Surface):
            depth, speed = -each.wall.clearance(y.position), each.wall.sign * y.velocity
            leaves = mode.at(Phase.CONTACT, each.wall.index) & (speed > 0) & (depth > 0)
            time = jnp.where(leaves, depth / jnp.where(leaves, speed, 1.0), time)
    return time
