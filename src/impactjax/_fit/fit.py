"""The verb `fit`: experiment → estimate."""

import dataclasses

import jax
import numpy as np
from jaxtyping import Float

from impactjax._fit.estimate import Estimate, P
from impactjax._fit.evaluation import Lanes
from impactjax._fit.scatter import with_scatter
from impactjax._fit.search import Search, Searches, lowest
from impactjax._fit.starts import Starts
from impactjax._fit.uncertainty import noise_variance, summarise
from impactjax._known import AnyArray, is_known, namespace
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._optimise.linearisation import Vector
from impactjax._problem.abstract_problem import AbstractProblem
from impactjax._problem.build_problem import build_problem
from impactjax._problem.experiment import Experiment
from impactjax._problem.problem import Problem
from impactjax._refusal import check_kind

_SAME = ("drift", "gain")  # parameters that keep their first value in all scattered starts
_LATE = (*_SAME, "cutoff")  # parameters that could make up for a wrong motion
_CLOSE = 1e-3  # damping near a minimum, relative to the usual one
_ROUGH = 1e-5  # relative decrease at which a search stops that may not be the best


def fit(
    experiment: Experiment,
    *,
    starts: Starts = Starts(1),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Estimate[Problem]:
    """Least-squares fit of a simulated to a recorded motion, with exact Jacobians.

    Prior knowledge of parameters counts as measurements of them: the sum of squares grows by
    s² Σ ((p − mean)/sigma)², with the variance s² of the residuals. That is the known one, or S/ν
    for the sum of squares S and the degrees of freedom ν of the fit, so that correlated residuals
    count by their effective number.

    Works under `jit` and `vmap`, over whole experiments or parts of them.

    **Arguments:**

    - `experiment`: recording, model with starting values, and prior information.
    - `starts`: starting points of the searches.
    - `optimiser`: settings of the searches.

    **Raises** `ValueError` for a name that the experiment does not have, a value that is out of
    range, a number in the model that is not declared as a `parameter`, and for a recording with
    fewer observations than parameters. A fit that does not converge says so in the estimate.
    """
    check_search(starts, optimiser)
    check_kind("experiment", experiment, Experiment, "Experiment(model, recording, initial)")
    return solve(build_problem(experiment), starts, optimiser)


def check_search(starts: Starts, optimiser: LevenbergMarquardt) -> None:
    """Raises `TypeError` for settings of another type."""
    check_kind("starts", starts, Starts, "Starts(16)")
    check_kind("optimiser", optimiser, LevenbergMarquardt, "LevenbergMarquardt()")


def solve(
    problem: Problem, starts: Starts, optimiser: LevenbergMarquardt, search: Search = Search()
) -> Estimate[Problem]:
    """The estimate of the best of several searches."""
    found = best_from(problem, starts.lanes(problem), optimiser, search)
    return scattered(found, search)


def best_from(
    problem: P,
    lanes: Lanes,
    optimiser: LevenbergMarquardt,
    search: Search = Search(),
    beside: Float[AnyArray, "others parameters"] | None = None,
) -> Estimate[P]:
    """The estimate of the best of several searches. These stop early, and the best is continued.
    Parameters that could make up for a wrong motion move only from the best minimum of the others,
    a cutoff also from infinity.

    **Arguments:**

    - `lanes`: starts in the coordinates of a search.
    - `beside`: further starts, close to a minimum. Their searches fit the whole record from the
      beginning, so that no cost ends above that of its start.
    """
    own, problem = problem, problem.padded() if is_known(problem) else problem
    everything = np.ones(lanes.shape, bool)
    moving = everything & ~np.isin(problem.names, _LATE)
    lanes = namespace(lanes).where(np.isin(problem.names, _SAME), lanes[:1], lanes)
    parts = problem.parts(optimiser.horizons)
    whole = namespace(parts).broadcast_to(parts[-1], parts.shape)
    several = is_known((problem, lanes)) and len(lanes) > 1
    first = _roughly(optimiser) if several else optimiser
    minima = search.minima(problem, first, Searches(lanes, moving, parts))
    if beside is not None:
        moves = np.ones(beside.shape, bool)
        more = lowest(search.minima(problem, first, Searches(beside, moves, whole)))
        minima = jax.tree.map(_with_last, minima, more)
    best, costs = lowest(minima), minima.cost
    if several or not moving.all():
        places = _with_faded(problem, best.u)
        moves = np.ones(places.shape, bool)
        close = Searches(places, moves, whole)
        last = lowest(search.minima(problem, _closely(optimiser), close))
        last = jax.tree.map(lambda x: x[None], last)
        last = last._replace(iterations=last.iterations + best.iterations)
        costs = namespace(costs).where(costs == best.cost, last.cost, costs)
        minima = last
    best = search.best_of(problem, minima, parts)
    estimate = summarise(problem, best, costs)
    if problem.weighs_anew:
        problem = problem.weighed(noise_variance(estimate))
        moves = np.ones((1, len(problem.names)), bool)
        again = search.minima(problem, _closely(optimiser), Searches(best.u[None], moves, whole))
        again = again._replace(iterations=again.iterations + best.iterations)
        costs = costs + (again.cost - best.cost)  # the lowest one stays that of the estimate
        estimate = summarise(problem, search.best_of(problem, again, parts), costs)
    return estimate.of(own)


def _with_faded(problem: AbstractProblem, u: Vector) -> Lanes:
    """A point, and beside it that at which the effects of parameters that fade have vanished."""
    xp, fades = namespace(u), np.array([each.allowed.fades for each in problem.handles().values()])
    if not fades.any():
        return u[None]
    vanished = xp.asarray([each.low for each in problem.limits()], u.dtype)
    return xp.stack([u, xp.where(fades, vanished, u)])


def _closely(optimiser: LevenbergMarquardt) -> LevenbergMarquardt:
    """Settings of searches that start close to the minimum."""
    return dataclasses.replace(optimiser, damping=_CLOSE * optimiser.damping)


def _roughly(optimiser: LevenbergMarquardt) -> LevenbergMarquardt:
    """Settings of searches from scattered starts, the best of which is continued."""
    return dataclasses.replace(optimiser, reduction=max(optimiser.reduction, _ROUGH))


def scattered(estimate: Estimate[Problem], search: Search) -> Estimate[Problem]:
    """The estimate, with scatter from impact to impact if its problem has it."""
    scatters = estimate.problem.scatter.scatters
    return with_scatter(estimate, search) if scatters else estimate


def _with_last(x: AnyArray, last: AnyArray) -> AnyArray:
    return namespace(x).concatenate([x[:-1], last[None]])
