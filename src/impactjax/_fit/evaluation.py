"""Evaluation of a point: the one program of all searches whose numbers are known."""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
from jaxtyping import Bool, Float

from impactjax._known import AnyArray
from impactjax._optimise.minimiser import Quadratic, Vector
from impactjax._problem.problem import AbstractProblem, Answer
from impactjax._types import Flag

Lanes = Float[AnyArray, "lanes parameters"]
Parts = Bool[AnyArray, "parts observations"]


class Evaluated(NamedTuple):
    """The answer at a point, and the sums of squares that follow from it.

    - `quadratics`: the sums of squares of the parts of the observations around it.
    """

    answer: Answer
    quadratics: Quadratic


Evaluate: TypeAlias = Callable[[AbstractProblem, Vector, Parts, Flag], Evaluated]


@eqx.filter_jit
def evaluate(problem: AbstractProblem, u: Vector, parts: Parts, logged: Flag) -> Evaluated:
    """Evaluates a point in the optimiser's coordinates, with the impact log if that is wanted.

    A lane alone: it takes half the time to compile that a batch would, and no longer to run.
    """
    answer = problem.answer(problem.values(u), logged)
    return Evaluated(answer, jax.vmap(lambda part: problem.around(u, answer, part))(parts))
