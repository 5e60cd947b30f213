"""Evaluation of a point: the only compiled program of searches outside `jit`."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, TypeAlias, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from impactjax._known import AnyArray, is_known, known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Linearisation, Vector
from impactjax._problem.abstract_problem import AbstractProblem, Answer
from impactjax._types import Flag

Lanes = Float[AnyArray, "lanes parameters"]
Parts = Bool[AnyArray, "parts observations"]
T = TypeVar("T")


class Evaluated(NamedTuple):
    """Evaluation of a point.

    - `answer`: residuals and their Jacobian.
    - `models`: linear models of the residuals, one for each part of the observations.
    """

    answer: Answer
    models: Linearisation


Evaluate: TypeAlias = Callable[[AbstractProblem, Vector, Parts, Flag], Evaluated]


@eqx.filter_jit
def evaluate(problem: AbstractProblem, u: Vector, parts: Parts, logged: Flag) -> Evaluated:
    """Evaluates a point in the coordinates of a search, with the impact log if `logged`.

    It evaluates one lane: a batch would take twice as long to compile, and run no faster.
    """
    answer = problem.answer(problem.at(u), logged)
    return Evaluated(answer, jax.vmap(lambda part: problem.around(u, answer, part))(parts))


def answer_at(
    problem: AbstractProblem, values: Vector, *, logged: bool = False, by: Evaluate = evaluate
) -> Answer:
    """Residuals and Jacobian of a problem at natural values, by the program of searches."""
    u = jnp.asarray(problem.coordinates(known(values)))
    parts = jnp.asarray(problem.parts(LevenbergMarquardt().horizons))
    return by(problem.of_record(), u, parts, jnp.asarray(logged)).answer


def side_by_side(function: Callable[[Vector], T], places: Lanes) -> list[T]:
    """The results of a function at some places, by as many threads as there are processors.

    The first result comes alone: it may have to be compiled, or be traced.
    """
    first = [function(place) for place in places[:1]]
    if len(places) < 3 or not is_known(first):
        return first + [function(place) for place in places[1:]]
    count = os.cpu_count() or 1
    with ThreadPoolExecutor(count) as pool:
        shares = pool.map(
            lambda some: [function(place) for place in some], np.array_split(places[1:], count)
        )
        return first + [result for share in shares for result in share]


def evaluate_each(problem: AbstractProblem, u: Vector, parts: Parts, logged: Flag) -> Evaluated:
    """Evaluates a point of several recordings, each by the program of one alone."""
    values, own = known(problem.at(known(u))), []
    for each, places in problem.each_recording():
        answer = answer_at(each.padded(), values[list(places)], logged=bool(logged))
        count = each.valid.shape[-1]
        assert answer.jacobian is not None
        rows = answer.residuals[:count], answer.jacobian[:count]
        own.append(answer._replace(residuals=rows[0], jacobian=rows[1]))
    answer = problem.joined(values, known(own))
    return Evaluated(answer, _models(problem, jnp.asarray(u), answer, parts))


@eqx.filter_jit
def _models(problem: AbstractProblem, u: Vector, answer: Answer, parts: Parts) -> Linearisation:
    return jax.vmap(lambda part: problem.around(u, answer, part))(parts)
