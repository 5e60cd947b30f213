"""Gradient descent with Optax that takes no step in silence that cannot be computed."""

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
_CALM = 1e-9  # relative change of the cost
_CALM_STEPS = 8  # in a row, after which the search ends
_SHORTEST = 1e-6  # of a step


class History(NamedTuple):
    """What has been done.

    - `costs`: after each step.
    - `iterations`: how many steps.
    - `refused`: how many of them could not be computed.
    """

    costs: Float[Array, " steps"]
    iterations: Int[Array, ""]
    refused: Int[Array, ""]


class Descent(NamedTuple):
    """Where a search is: the last point that could be computed, and the step proposed from it."""

    point: Vector
    cost: Scalar
    move: Vector
    share: Scalar  # of the move to take
    memory: "optax.OptState"
    best: Vector
    lowest: Scalar
    calm: Int[Array, ""]
    unit: Scalar
    history: History

    @property
    def over(self) -> Flag:
        """Whether the cost does not change any more, or no step can be computed."""
        return (self.calm >= _CALM_STEPS) | (self.share < _SHORTEST)


def begin(
    optimiser: "optax.GradientTransformation", start: Vector, unit: Scalar, history: History
) -> Descent:
    """Before the first step; `unit` is what the history's costs have."""
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
    """Computes the point that was proposed, and a proposal from there; half of the step next time
    if cost or gradient is not finite.
    """
    import optax  # a tenth of a second that `fit` can do without

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
    nowhere = ~jnp.isfinite(now.cost)  # not even the start
    back = now._replace(share=jnp.where(nowhere, 0.0, now.share / 2), history=history)
    return jax.tree.map(lambda new, old: jnp.where(fine, new, old), taken, back)


def _by_forward_mode(cost: Cost) -> Cost:
    """The same function, whose gradient is computed in forward mode even if reverse is asked."""

    def both(point: Vector) -> tuple[Scalar, Scalar]:
        value = cost(point)
        return value, value

    def forward(point: Vector) -> tuple[Scalar, Vector]:
        slope, value = jax.jacfwd(both, has_aux=True)(point)
        return value, slope

    function = jax.custom_vjp(cost)
    function.defvjp(forward, lambda slope, pull: (pull * slope,))
    return function
