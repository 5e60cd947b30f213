"""Chains of the no-U-turn sampler of NumPyro.

The transitions are those of `numpyro.infer.hmc.hmc`; the density is an argument of the compiled
program, so that another recording or another value does not compile again.

Source: M. D. Hoffman and A. Gelman (2014), "The no-U-turn sampler", Journal of Machine Learning
Research 15, 1593.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from impactjax._identify.density import Density
from impactjax._known import AnyArray
from impactjax._optimise.linearisation import Vector
from impactjax._types import Scalar

_TOGETHER = 50  # transitions between two reports of progress
_ACCEPTED = (
    0.9  # mean probability of acceptance: more than usual, since the density has steep walls
)

Progress = Callable[[int, int], None]


class Place(NamedTuple):
    """A point in scaled coordinates, its log-density and the gradient of that."""

    at: Vector
    log_density: Scalar
    gradient: Vector


class Draws(NamedTuple):
    """Draws of several chains.

    - `place`: scaled coordinates.
    - `log_density`: logarithm of their density.
    - `energy`: of the Hamiltonian.
    - `diverging`: true after a transition whose energy was not conserved.
    - `steps`: number of evaluations of the density in a transition.
    - `acceptance`: mean probability of acceptance in a transition.
    - `step_size`: of the integrator.
    """

    place: Float[AnyArray, "*chains draws parameters"]
    log_density: Float[AnyArray, "*chains draws"]
    energy: Float[AnyArray, "*chains draws"]
    diverging: Bool[AnyArray, "*chains draws"]
    steps: Int[AnyArray, "*chains draws"]
    acceptance: Float[AnyArray, "*chains draws"]
    step_size: Float[AnyArray, "*chains draws"]


class Length(NamedTuple):
    """Lengths of a chain: transitions for warm-up, and draws after it."""

    warmup: int
    draws: int


def sampled(
    density: Density,
    starts: Sequence[Place],
    keys: Key[Array, " chains"],
    length: Length,
    progress: Progress,
) -> Draws:
    """Draws after the warm-up, in which the step size and the mass matrix are adapted.

    Each chain is a run of its own, since a batch would wait for the longest transition of all.
    """
    states = [_begun(density, *each, length.warmup) for each in zip(starts, keys, strict=True)]
    whole, parts = sum(length), []
    for done in range(0, whole, _TOGETHER):
        # Dispatch all chains before waiting for the first.
        found = [_advanced(density, state, length.warmup) for state in states]
        states = [state for state, _ in found]
        own = [jax.tree.map(np.asarray, part) for _, part in found]
        parts.append(jax.tree.map(lambda *each: np.stack(each), *own))
        progress(min(done + _TOGETHER, whole), whole)
    joined = jax.tree.map(lambda *each: np.concatenate(each, axis=1), *parts)
    return jax.tree.map(lambda x: x[:, length.warmup : whole], joined)


@eqx.filter_jit
def _begun(density: Density, place: Place, key: Key[Array, ""], warmup: int) -> PyTree:
    begin, _ = _sampler(density, warmup)
    return begin(place, key)


@eqx.filter_jit
def _advanced(density: Density, state: PyTree, warmup: int) -> tuple[PyTree, Draws]:
    """State and draws some transitions later."""
    begin, transition = _sampler(density, warmup)
    here = Place(state.z, -state.potential_energy, -state.z_grad)
    begin(here, state.rng_key)  # tells the sampler its settings

    def next_draw(state: PyTree, nothing: None) -> tuple[PyTree, Draws]:
        del nothing
        state = transition(state)
        return state, Draws(
            place=state.z,
            log_density=-state.potential_energy,
            energy=state.energy,
            diverging=state.diverging,
            steps=state.num_steps,
            acceptance=state.accept_prob,
            step_size=state.adapt_state.step_size,
        )

    return jax.lax.scan(next_draw, state, length=_TOGETHER)


def _sampler(
    density: Density, warmup: int
) -> tuple[Callable[[Place, Key[Array, ""]], Any], Callable[[Any], Any]]:
    """The first state, and a transition, of the no-U-turn sampler."""
    from numpyro.infer.hmc import hmc
    from numpyro.infer.util import ParamInfo

    begin, transition = hmc(density.potential)

    def first(place: Place, key: Key[Array, ""]) -> Any:  # noqa: ANN401  NumPyro names no type for it
        begun = ParamInfo(place.at, -place.log_density, -place.gradient)
        settings = {"num_warmup": warmup, "dense_mass": True, "target_accept_prob": _ACCEPTED}
        return begin(begun, rng_key=key, **settings)

    return first, transition
