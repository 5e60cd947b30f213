"""Butcher tableau of an explicit Runge-Kutta method, as arrays for a loop over its stages."""

from typing import TYPE_CHECKING, NamedTuple, cast

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._types import Code, Scalar

if TYPE_CHECKING:
    import diffrax

Weights = Float[Array, " stages"]


class Stage(NamedTuple):
    """A stage, or all: its number, its place in the step, and the weights of all stages in it."""

    number: Code
    node: Scalar
    weights: Weights


class Butcher(NamedTuple):
    """All stages, and the weights of the end of the step and of its error."""

    stages: Stage
    end: Weights
    error: Weights


def butcher(solver: "diffrax.AbstractERK", dtype: np.dtype) -> Butcher:
    """The tableau of a method of Diffrax."""
    tableau = cast("diffrax.ButcherTableau", solver.tableau)
    nodes = np.array([0.0, *tableau.c])
    weights = np.zeros((nodes.size, nodes.size))
    for number, row in enumerate(tableau.a_lower, start=1):
        weights[number, :number] = row
    numbers = jnp.arange(nodes.size, dtype=jnp.int32)
    stages = Stage(numbers, jnp.asarray(nodes, dtype), jnp.asarray(weights, dtype))
    return Butcher(stages, jnp.asarray(tableau.b_sol, dtype), jnp.asarray(tableau.b_error, dtype))
