"""Stages of an explicit Runge-Kutta method.

They are passes of one loop, so that the program does not grow with their number.
"""

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._hybrid.butcher import Stage, Weights, butcher
from impactjax._hybrid.varying import alike
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.flow import driven_acceleration
from impactjax._simulate.grading import Grading
from impactjax._simulate.state import Mode, State
from impactjax._types import Scalar

if TYPE_CHECKING:
    import diffrax

Durations = Float[Array, " durations"]
_Rates = Float[Array, "stages durations"]


class Begin(NamedTuple):
    """Start of a step, and the grading of its stages."""

    t: Scalar
    y: State
    grading: Grading


@jax.jit(static_argnums=0)  # so that it is not traced anew for each use
def ends_of_steps(
    solver: "diffrax.AbstractERK",
    automaton: Automaton,
    mode: Mode,
    begin: Begin,
    h: Durations,
    slowest: Scalar,
) -> tuple[State, Durations]:
    """The states after steps of several durations `h` from one start, with an axis of durations,
    and their errors relative to the motion of each step, whose speed counts as at least `slowest`.

    The velocity that the mass would have without friction and stops is integrated too, so that it
    limits the step at rest as well.
    """
    t, y, grading = begin
    leaves, structure = jax.tree.flatten(y)
    leaves = [*leaves, y.velocity]

    def rates(now: Scalar, leaves: list[Scalar]) -> list[Scalar]:
        state = jax.tree.unflatten(structure, leaves[:-1])
        drive = driven_acceleration(automaton.model, now, state, mode)
        return [*jax.tree.leaves(automaton.flow(now, state, mode)), drive]

    def moved(weights: Weights, stages: list[_Rates]) -> list[Durations]:
        ways = [_way(h, weights, each) for each in stages]
        return [leaf + way for leaf, way in zip(leaves, ways, strict=True)]

    def with_stage(stages: list[_Rates], row: Stage) -> tuple[list[_Rates], None]:
        def graded(h: Scalar, moved: list[Scalar]) -> list[Scalar]:
            return grading.stage(row.node, rates(t + grading.share(row.node) * h, moved))

        found = jax.vmap(graded)(h, moved(row.weights, stages))
        set_row = partial(jax.lax.dynamic_update_index_in_dim, index=row.number, axis=0)
        stages = [set_row(each, own) for each, own in zip(stages, found, strict=True)]
        return alike(stages, everything), None

    everything = automaton, mode, begin, h
    tableau = butcher(solver, h.dtype)
    nothing = [jnp.zeros((tableau.end.size, h.size), h.dtype) for _ in leaves]
    stages, _ = jax.lax.scan(with_stage, alike(nothing, everything), tableau.stages)
    ends, errors = moved(tableau.end, stages), [_way(h, tableau.error, each) for each in stages]
    none, first = jnp.zeros_like(slowest), rates(t, leaves)
    slow = [none, slowest, *[none] * (len(leaves) - 3), slowest]  # of position, velocity, and so on
    ways = [jnp.maximum(jnp.abs(h * dy), floor) for dy, floor in zip(first, slow, strict=True)]
    return jax.tree.unflatten(structure, ends[:-1]), _relative(errors, leaves, ends, ways)


def _way(h: Durations, weights: Weights, stages: _Rates) -> Durations:
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
