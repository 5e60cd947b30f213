"""The problem that `learn` solves, and its result."""

from collections.abc import Callable
from functools import reduce
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int, PyTree

from impactjax._problem.abstract_problem import Answer
from impactjax._problem.parameters import handles, replaced
from impactjax._problem.problem import Problem
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog
from impactjax._types import Scalar

Where = Callable[[Any], PyTree]  # of a System, as a lambda without types may write it
Numbers = Float[Array, " numbers"]


class Task(eqx.Module):
    """A problem in which some unnamed arrays, the weights, are fitted as well.

    The unknowns are one vector of unbounded numbers: the unbounded coordinates of the named
    parameters, as in `fit`, then the weights.

    - `places`: indices of the leaves of the system that are weights.
    """

    problem: Problem
    places: tuple[int, ...] = eqx.field(static=True)

    def start(self) -> Numbers:
        """The numbers at the system's own values."""
        return ravel_pytree(self._parts())[0]

    def system(self, numbers: Numbers) -> System:
        """The system with parameters and weights set from numbers."""
        named, weights = ravel_pytree(self._parts())[1](numbers)
        leaves, structure = jax.tree.flatten(self.problem.system)
        for i, weight in zip(self.places, weights, strict=True):
            leaves[i] = weight
        values = list(self.problem.values(named))
        return replaced(jax.tree.unflatten(structure, leaves), self.problem.names, values)

    def answer(self, numbers: Numbers) -> Answer:
        """Residuals of the simulated system, with their Jacobian."""

        def residuals(numbers: Numbers) -> tuple[Array, Answer]:
            answer = self.problem.simulated(self.system(numbers))
            return answer.residuals, answer

        jacobian, answer = jax.jacfwd(residuals, has_aux=True)(numbers)
        return answer._replace(jacobian=jacobian)

    def cost(self, numbers: Numbers) -> Scalar:
        """Loss of the simulated system."""
        answer = self.problem.simulated(self.system(numbers))
        return jnp.sum(self.problem.loss.cost(answer.residuals))

    def _parts(self) -> tuple[Array, tuple[Array, ...]]:
        system = self.problem.system
        values = jnp.stack([place.get(system) for place in self.problem.handles().values()])
        leaves = jax.tree.leaves(system)
        return self.problem.unbounded(values), tuple(leaves[i] for i in self.places)


class Learned(eqx.Module):
    """Result of `learn`: the best system.

    - `numbers`: its unbounded coordinates and weights.
    - `costs`: the cost, half the sum of squares, after each step; NaN for steps not taken.
    - `iterations`: number of steps taken.
    - `refused`: number of steps rejected because the cost or its gradient is not finite there; a
      rejected step is tried again at half its length.
    - `converged`: true if the expected Gauss-Newton decrease of the cost is that of a step of less
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
        """The named parameters that were fitted."""
        return self.task.problem.names

    @property
    def system(self) -> System:
        """Model, initial state and sensor with the learned values, for a single search."""
        return self.task.system(self.numbers)

    def value(self, name: str) -> Scalar:
        """The value of a named parameter, for a single search."""
        return handles(self.task.problem.system)[name].get(self.system)


def no_weights(system: System) -> tuple[()]:
    """Default of `where`, which selects no arrays."""
    del system
    return ()


def places(system: System, where: Where) -> tuple[int, ...]:
    """Indices of the leaves of a system that `where` selects.

    **Raises** `ValueError` if one of them is a named parameter.
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
