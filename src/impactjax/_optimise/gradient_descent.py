"""Gradient descent with Optax; a step to a non-finite cost is rejected, halved and counted."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, cast

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from impactjax._types import Flag, Scalar

if TYPE_CHECKING:
    import optax

Vector = Float[Array, " numbers"]
Cost = Callable[[Vector], Scalar]

_FORWARD = 48  # numbers up to which a gradient is faster, and compiled sooner, by forward mode
_CALM = 1e-9  # relative change of the cost below which a step counts as calm
_CALM_STEPS = 8  # consecutive calm steps after which the search ends
_SHORTEST = 1e-6  # share of a proposed step below which the search gives up


class History(NamedTuple):
    """Record of the steps taken.

    - `costs`: cost after each step.
    - `iterations`: number of steps.
    - `refused`: number of steps whose cost or gradient was not finite.
    """

    costs: Float[Array, " steps"]
    iterations: Int[Array, ""]
    refused: Int[Array, ""]


class Descent(NamedTuple):
    """State of a search.

    - `point`, `cost`: the last point with a finite cost and gradient.
    - `move`, `share`: the step proposed from there, and the share of it to take.
    - `memory`: the state of the Optax optimiser.
    - `best`, `lowest`: the best point so far and its cost.
    - `calm`: consecutive steps that hardly changed the cost.
    - `unit`: factor by which the costs in `history` are larger than those of the search.
    """

    point: Vector
    cost: Scalar
    move: Vector
    share: Scalar
    memory: "optax.OptState"
    best: Vector
    lowest: Scalar
    calm: Int[Array, ""]
    unit: Scalar
    history: History

    @property
    def over(self) -> Flag:
        """True if the cost has stopped changing, or no step leads to a finite cost."""
        return (self.calm >= _CALM_STEPS) | (self.share < _SHORTEST)


def begin(
    optimiser: "optax.GradientTransformation", start: Vector, unit: Scalar, history: History
) -> Descent:
    """State before the first step; `unit` is the factor from its costs to those of the history."""
    one = jnp.ones((), start.dtype)
    return Descent(
        point=start,
        cost=one * jnp.inf,
        move=jnp.zeros_like(start),
        share=one,
        memory=optimiser.init(start),
        best=start,
        lowest=one * jnp.inf,
        calm=jnp.zeros((), jnp.int32),
        unit=unit,
        history=history,
    )


def step(optimiser: "optax.GradientTransformation", cost: Cost, now: Descent) -> Descent:
    """Evaluates the proposed point and proposes a step from there.

    If the cost or the gradient is not finite, the point is rejected and half the step is proposed.
    """
    import optax  # takes 0.1 s to import; `fit` does not need it

    function = cost if now.point.size > _FORWARD else _by_forward_mode(cost)
    trial = now.point + now.share * now.move
    value, slope = jax.value_and_grad(function)(trial)
    fine = jnp.isfinite(value) & jnp.all(jnp.isfinite(slope))
    with jax.numpy_dtype_promotion("standard"):  # Optax mixes kinds of integers
        move, memory = optax.with_extra_args_support(optimiser).update(
            slope, now.memory, trial, value=value, grad=slope, value_fn=function
        )
    better = fine & (value < now.lowest)
    calm = jnp.abs(value - now.cost) <= _CALM * value
    costs, iterations, refused = now.history
    history = History(
        costs.at[iterations].set(jnp.where(fine, value, now.cost) * now.unit),
        iterations + 1,
        refused + jnp.where(fine, 0, 1),
    )
    taken = Descent(
        point=trial,
        cost=value,
        move=cast(Vector, move),
        share=jnp.ones_like(now.share),
        memory=memory,
        best=jnp.where(better, trial, now.best),
        lowest=jnp.where(better, value, now.lowest),
        calm=jnp.where(calm, now.calm + 1, 0),
        unit=now.unit,
        history=history,
    )
    nowhere = ~jnp.isfinite(now.cost)  # not even the start has a finite cost
    back = now._replace(share=jnp.where(nowhere, 0.0, now.share / 2), history=history)
    return jax.tree.map(lambda new, old: jnp.where(fine, new, old), taken, back)


def _by_forward_mode(cost: Cost) -> Cost:
    """The same function; reverse-mode differentiation of it runs in forward mode instead."""

    def both(point: Vector) -> tuple[Scalar, Scalar]:
        value = cost(point)
        return value, value

    def forward(point: Vector) -> tuple[Scalar, Vector]:
        slope, value = jax.jacfwd(both, has_aux=True)(point)
        return value, slope

    function = jax.custom_vjp(cost)
    function.defvjp(forward, lambda slope, pull: (pull * slope,))
    return function
