"""Stages of an explicit Runge-Kutta method.

They are passes of one loop, so that the program does not grow with their number.
"""

from functools import partial
from typing import TYPE_CHECKING, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._hybrid.varying import alike
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.flow import driven_acceleration
from impactjax._simulate.grading import Grading
from impactjax._simulate.state import Mode, State
from impactjax._types import Code, Scalar

if TYPE_CHECKING:
    import diffrax

Durations = Float[Array, " durations"]
_Rates = Float[Array, "stages durations"]


class _Stage(NamedTuple):
    """A row of the Butcher tableau: its number, its place in the step, and the weights of all
    stages.
    """

    number: Code
    sigma: Scalar
    weights: Float[Array, " stages"]


@jax.jit(static_argnums=0)  # so that it is traced once, for attempts, samples and derivatives alike
def ends_of_steps(
    solver: "diffrax.AbstractERK",
    automaton: Automaton,
    t: Scalar,
    y: State,
    mode: Mode,
    grading: Grading,
    h: Durations,
    slowest: Scalar,
) -> tuple[State, Durations]:
    """The states after steps of several durations `h` from one start, with an axis of durations,
    and their errors relative to the motion of each step, whose speed counts as at least `slowest`.

    The velocity that the mass would have without friction and stops is integrated too, so that it
    limits the step at rest as well.
    """
    leaves, structure = jax.tree.flatten(y)
    leaves = [*leaves, y.velocity]

    def rates(now: Scalar, leaves: list[Scalar]) -> list[Scalar]:
        state = jax.tree.unflatten(structure, leaves[:-1])
        drive = driven_acceleration(automaton.model, now, state, mode)
        return [*jax.tree.leaves(automaton.flow(now, state, mode)), drive]

    def moved(weights: Float[Array, " stages"], stages: list[_Rates]) -> list[Durations]:
        ways = [_way(h, weights, each) for each in stages]
        return [leaf + way for leaf, way in zip(leaves, ways, strict=True)]

    def with_stage(stages: list[_Rates], row: _Stage) -> tuple[list[_Rates], None]:
        def graded(h: Scalar, moved: list[Scalar]) -> list[Scalar]:
            return grading.stage(row.sigma, rates(t + grading.share(row.sigma) * h, moved))

        found = jax.vmap(graded)(h, moved(row.weights, stages))
        set_row = partial(jax.lax.dynamic_update_index_in_dim, index=row.number, axis=0)
        stages = [set_row(each, own) for each, own in zip(stages, found, strict=True)]
        return alike(stages, everything), None

    everything = automaton, t, leaves, mode, grading, h
    rows, total, difference = _tableau(solver, h.dtype)
    nothing = [jnp.zeros((total.size, h.size), h.dtype) for _ in leaves]
    stages, _ = jax.lax.scan(with_stage, alike(nothing, everything), rows)
    ends, errors = moved(total, stages), [_way(h, difference, each) for each in stages]
    none, first = jnp.zeros_like(slowest), rates(t, leaves)
    slow = [none, slowest, *[none] * (len(leaves) - 3), slowest]  # of position, velocity, and so on
    ways = [jnp.maximum(jnp.abs(h * dy), floor) for dy, floor in zip(first, slow, strict=True)]
    return jax.tree.unflatten(structure, ends[:-1]), _relative(errors, leaves, ends, ways)


def _tableau(
    solver: "diffrax.AbstractERK", dtype: np.dtype
) -> tuple[_Stage, Float[Array, " stages"], Float[Array, " stages"]]:
    """All stages, and the weights of the end and of its error."""
    tableau = cast("diffrax.ButcherTableau", solver.tableau)
    nodes = np.array([0.0, *tableau.c])
    weights = np.zeros((nodes.size, nodes.size))
    for number, row in enumerate(tableau.a_lower, start=1):
        weights[number, :number] = row
    numbers = jnp.arange(nodes.size, dtype=jnp.int32)
    rows = _Stage(numbers, jnp.asarray(nodes, dtype), jnp.asarray(weights, dtype))
    return rows, jnp.asarray(tableau.b_sol, dtype), jnp.asarray(tableau.b_error, dtype)


def _way(h: Durations, weights: Float[Array, " stages"], stages: _Rates) -> Durations:
    """The way h Σ wⱼ kⱼ. By a matrix product: the compiler rounds sums of few and of many lanes
    differently.
    """
    return h * (weights @ stages)


def _relative(
    errors: list[Durations], begins: list[Scalar], ends: list[Durations], ways: list[Durations]
) -> Durations:
    """The largest error, each relative to the largest of a number's begin, end and way."""
    largest = jnp.zeros_like(errors[0])
    for error, y0, y1, way in zip(errors, begins, ends, ways, strict=True):
        size = jnp.maximum(jnp.maximum(jnp.abs(y0), jnp.abs(y1)), way)
        largest = jnp.maximum(largest, jnp.abs(error) / (size + jnp.finfo(size.dtype).tiny))
    return largest
