"""What is learned, and what `learn` returns."""

from collections.abc import Callable
from functools import reduce
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int, PyTree

from impactjax._problem.parameters import handles, replaced
from impactjax._problem.problem import Answer, Problem
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog
from impactjax._types import Scalar

Where = Callable[[Any], PyTree]  # of a System, as a lambda without types may write it
Numbers = Float[Array, " numbers"]


class Task(eqx.Module):
    """A problem of which some arrays without names, weights, are to be found too.

    All that is to be found is one vector of numbers without bounds: what stands for the parameters
    with names in their ranges, as in `fit`, then the weights.

    - `places`: which leaves of the system are weights.
    """

    problem: Problem
    places: tuple[int, ...] = eqx.field(static=True)

    def start(self) -> Numbers:
        """The numbers of the system's own values."""
        return ravel_pytree(self._parts())[0]

    def system(self, numbers: Numbers) -> System:
        """The system that numbers stand for."""
        named, weights = ravel_pytree(self._parts())[1](numbers)
        leaves, structure = jax.tree.flatten(self.problem.system)
        for i, weight in zip(self.places, weights, strict=True):
            leaves[i] = weight
        values = list(self.problem.values(named))
        return replaced(jax.tree.unflatten(structure, leaves), self.problem.names, values)

    def answer(self, numbers: Numbers) -> Answer:
        """What a simulation of that system says about the recording, with derivatives."""

        def residuals(numbers: Numbers) -> tuple[Array, Answer]:
            answer = self.problem.simulated(self.system(numbers))
            return answer.residuals, answer

        jacobian, answer = jax.jacfwd(residuals, has_aux=True)(numbers)
        return answer._replace(jacobian=jacobian)

    def cost(self, numbers: Numbers) -> Scalar:
        """The cost of that system, by the problem's loss."""
        answer = self.problem.simulated(self.system(numbers))
        return jnp.sum(self.problem.loss.cost(answer.residuals))

    def _parts(self) -> tuple[Array, tuple[Array, ...]]:
        system = self.problem.system
        values = jnp.stack([place.get(system) for place in self.problem.handles().values()])
        leaves = jax.tree.leaves(system)
        return self.problem.unbounded(values), tuple(leaves[i] for i in self.places)


class Learned(eqx.Module):
    """The best system that was found.

    - `numbers`: what stands for it.
    - `costs`: the cost, half the sum of squares, after each step; NaN for steps not taken.
    - `iterations`: how many steps were taken.
    - `refused`: how many of them led where the cost or its gradient is not finite, and were taken
      back; half as long a step was tried next.
    - `converged`: whether the step to the minimum that Gauss and Newton would expect is worth less
      than a tenth of a standard error.
    - `residuals`: simulated minus recorded, in the recording's SI unit; 0 if not valid.
    - `jacobian`: derivatives of the residuals by `numbers`.
    - `impacts`: the impact log.
    - `rms`: root of the mean square of the residuals.
    """

    task: Task
    numbers: Float[Array, "... numbers"]
    costs: Float[Array, "... steps"]
    iterations: Int[Array, "..."]
    refused: Int[Array, "..."]
    converged: Bool[Array, "..."]
    residuals: Float[Array, "... observations"]
    jacobian: Float[Array, "... observations numbers"]
    impacts: ImpactLog
    rms: Float[Array, "..."]

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters with names that were found."""
        return self.task.problem.names

    @property
    def system(self) -> System:
        """Model, initial state and sensor with what was found, of a single search."""
        return self.task.system(self.numbers)

    def value(self, name: str) -> Scalar:
        """The value of a parameter with a name, of a single search."""
        return handles(self.task.problem.system)[name].get(self.system)


def no_weights(system: System) -> tuple[()]:
    """Picks nothing."""
    del system
    return ()


def places(system: System, where: Where) -> tuple[int, ...]:
    """Which leaves of a system `where` picks.

    **Raises** `ValueError` if one of them is a parameter with a name.
    """
    leaves, structure = jax.tree.flatten(system)
    numbered = jax.tree.unflatten(structure, range(len(leaves)))
    chosen = tuple(jax.tree.leaves(where(numbered)))
    for name, handle in handles(system).items():
        if reduce(getattr, handle.path, numbered) in chosen:
            raise ValueError(
                f"Argument `where` picks the parameter `{name}`, which has a name and a range; "
                "arguments `fixed` and `free` say whether it is found."
            )
    return chosen
