"""Searches from many starts: one compiled evaluation for all, or one program under `jit`."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PyTree

from impactjax._fit.evaluation import (
    Evaluate,
    Evaluated,
    Lanes,
    Parts,
    evaluate,
    evaluate_each,
    side_by_side,
)
from impactjax._known import AnyArray, is_known, known, namespace
from impactjax._optimise.coordinates import limits, slope, to_value
from impactjax._optimise.lane_queue import Iteration, in_turn
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Linearisation, Vector
from impactjax._optimise.minimiser import (
    Bounds,
    Count,
    Mask,
    Minimiser,
    Minimum,
    Objective,
    Point,
    State,
)
from impactjax._parameter import Range
from impactjax._problem.abstract_problem import AbstractProblem, Answer

_EARLY = 1e-3  # relative decrease that counts as convergence on a part before the last
_LEAST = 0.1  # least usual step, relative to the longest


class Searches(NamedTuple):
    """Searches of one problem.

    - `starts`: starting points in the coordinates of a search.
    - `active`: masks of the parameters that may move in each search.
    - `parts`: masks of the observations to fit one after the other; the last has all.
    """

    starts: Lanes
    active: Bool[AnyArray, "lanes parameters"]
    parts: Parts


@dataclasses.dataclass(frozen=True)
class Search:
    """Method of searching from many starts.

    - `evaluate`: function that evaluates a point.
    """

    evaluate: Evaluate = evaluate

    def minima(
        self, problem: AbstractProblem, optimiser: LevenbergMarquardt, searches: Searches
    ) -> Minimum:
        """The minimum from each start. On earlier parts, parameters that the data do not determine
        stay near their start.
        """
        if is_known((problem, searches)):
            found = _known(self.evaluate, problem, optimiser, known(searches))
            if found is not None:
                return found
        return _traced(problem, optimiser, searches)

    def linearised(self, problem: AbstractProblem, searches: Searches) -> Linearisation:
        """The linear model of all observations around each start."""
        no, parts = jnp.zeros((), bool), jnp.asarray(searches.parts)
        record, informed = problem.of_record(), known(problem).informed
        counts = known(searches.parts).sum(axis=1).astype(searches.starts.dtype)

        def at(place: Vector) -> Linearisation:
            found = self.evaluate(record, jnp.asarray(place), parts, no)
            models = known(jax.block_until_ready(found).models)
            return informed(place, jax.tree.map(lambda x: x[-1], models), counts[-1])

        found = side_by_side(at, searches.starts)
        return jax.tree.map(lambda *each: np.stack(each), *found)

    def best_of(self, problem: AbstractProblem, minima: Minimum, parts: Parts) -> Minimum:
        """The lowest of several minima, with its impact log."""
        best = lowest(minima)
        if not is_known((problem, best)):
            return best
        yes = jnp.ones((), bool)
        again = self.evaluate(problem.of_record(), jnp.asarray(best.u), jnp.asarray(parts), yes)
        answer = best.answer._replace(impacts=again.answer.impacts)
        return best._replace(answer=answer)


def usual_search(problem: AbstractProblem) -> Search:
    """The search for a problem: recordings that are fitted together are evaluated one by one."""
    return Search(evaluate_each) if len(problem.each_recording()) > 1 else Search()


def _known(
    evaluate: Evaluate,
    problem: AbstractProblem,
    optimiser: LevenbergMarquardt,
    searches: Searches,
) -> Minimum | None:
    """Searches carried out in NumPy, around compiled evaluations.

    `None` if the evaluations turn out to be traced, because a tie closes over a traced value.
    """
    starts, parts = searches.starts, jnp.asarray(searches.parts)
    count, ranges = starts.shape[1], problem.ranges()
    infinite = Linearisation(np.array(np.inf), np.zeros(count), np.zeros((count, count)))
    record, informed = problem.of_record(), known(problem).informed
    counts = known(parts).sum(axis=1).astype(starts.dtype)

    def around(u: Vector, answer: Evaluated | None, part: Count) -> Linearisation:
        if answer is None:
            return infinite
        return informed(u, jax.tree.map(lambda x: x[part], answer.models), counts[part])

    def minimiser(start: Vector, active: Mask) -> Minimiser[Evaluated | None]:
        objective = Objective(around, _reductions(optimiser, parts, start))
        nothing: Point = Point(start, None, infinite)
        return Minimiser(optimiser, objective, bounds_of(ranges, start, active), nothing)

    def at(place: Vector) -> Evaluated:
        return known(jax.block_until_ready(evaluate(record, jnp.asarray(place), parts, no)))

    no, answers = jnp.zeros((), bool), []
    with np.errstate(all="ignore"):
        each = [minimiser(*lane) for lane in zip(starts, searches.active, strict=True)]
        states = [own.init(start) for own, start in zip(each, starts, strict=True)]
        while going := [i for i, state in enumerate(states) if not state.done]:
            answers = side_by_side(at, np.stack([states[i].trial for i in going]))
            if not is_known(answers):
                return None
            for i, answer in zip(going, answers, strict=True):
                states[i] = each[i].step(states[i], answer)
    return _stacked([state.minimum for state in states], answers[0])


def _stacked(minima: list[Minimum], like: Evaluated) -> Minimum:
    """Minima stacked to one; answers of searches without a finite evaluation are zeros."""
    zeros = jax.tree.map(np.zeros_like, like.answer)
    answers = [zeros if each.answer is None else each.answer.answer for each in minima]
    rows = [x._replace(answer=own) for x, own in zip(minima, answers, strict=True)]
    return jax.tree.map(lambda *each: np.stack(each), *rows)


@eqx.filter_jit
def _traced(problem: AbstractProblem, optimiser: LevenbergMarquardt, searches: Searches) -> Minimum:
    """Searches inside one program, as a queue of lanes."""
    starts, active, parts = searches
    # Trace the evaluation once, with the values its ties close over as arguments.
    answering = eqx.filter_closure_convert(eqx.Partial(_answered), problem, starts[0])
    arrays, other = eqx.partition((problem, parts, answering), eqx.is_array)

    def minimiser(arrays: PyTree, lane: tuple[Vector, Mask]) -> Minimiser[Answer]:
        (problem, parts, answering), (start, on) = eqx.combine(arrays, other), lane

        def around(u: Vector, answer: Answer, part: Count | int) -> Linearisation:
            model, count = problem.around(u, answer, parts[part]), jnp.sum(parts[part])
            return problem.informed(u, model, count.astype(u.dtype))

        objective = Objective(around, _reductions(optimiser, parts, start))
        shapes = jax.eval_shape(lambda u: answering(problem, u), start)
        answer = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
        model = around(start, answer, 0)
        infinite = jax.tree.map(jnp.zeros_like, model)
        infinite = infinite._replace(cost=jnp.full_like(model.cost, jnp.inf))
        nothing = Point(start, answer, infinite)
        return Minimiser(optimiser, objective, bounds_of(problem.ranges(), start, on), nothing)

    def step(arrays: PyTree, lane: tuple[Vector, Mask], state: State) -> State:
        (problem, _, answering) = eqx.combine(arrays, other)
        return minimiser(arrays, lane).step(state, answering(problem, state.trial))

    iteration = Iteration(
        init=lambda arrays, lane: minimiser(arrays, lane).init(lane[0]),
        step=step,
        done=lambda state: state.done,
        result=lambda state: state.minimum,
    )
    return in_turn(iteration, arrays, (starts, active))


def _answered(problem: AbstractProblem, u: Vector) -> Answer:
    return problem.answer(problem.at(u))


def _reductions(
    optimiser: LevenbergMarquardt, parts: Parts, start: Vector
) -> Float[AnyArray, " parts"]:
    each = [*[_EARLY] * (len(parts) - 1), optimiser.reduction]
    return namespace(start).asarray(each, start.dtype)


def bounds_of(ranges: Sequence[Range], start: Vector, active: Mask) -> Bounds:
    """Limits of a search in coordinates of parameters with some ranges."""
    rows = zip(*map(limits, ranges), strict=True)
    low, high, reach = (namespace(start).asarray(row, start.dtype) for row in rows)
    return Bounds(active, low, high, reach, _usual_moves(ranges, start, reach))


def _usual_moves(ranges: Sequence[Range], start: Vector, reach: Vector) -> Vector:
    """Step that changes a value by about 100 %; `inf` for a parameter without limits that starts
    at 0, or so close to it that its square has no digits.
    """
    xp = namespace(start)
    values = [to_value(allowed, u) for allowed, u in zip(ranges, start, strict=True)]
    slopes = [slope(allowed, u) for allowed, u in zip(ranges, start, strict=True)]
    moves = xp.abs(xp.stack(values) / xp.stack(slopes))
    anything = xp.where(moves > float(np.finfo(start.dtype).tiny) ** 0.25, moves, xp.inf)
    return xp.where(xp.isfinite(reach), xp.clip(moves, _LEAST * reach, reach), anything)


def lowest(minima: Minimum) -> Minimum:
    """The lowest of several minima."""
    xp = namespace(minima.cost)
    best = xp.argmin(xp.where(xp.isfinite(minima.cost), minima.cost, xp.inf))
    return jax.tree.map(lambda x: x[best], minima)
