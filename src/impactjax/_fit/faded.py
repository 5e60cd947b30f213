"""Parameters that fade, such as a cutoff, in a record that may not show their effect.

Without the effect the other parameters have a minimum of their own. A profile from the other
minimum does not reach it, since nothing changes far from the effect.
"""

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._fit.fit import closely
from impactjax._fit.scatter_summary import likelier
from impactjax._fit.search import Search, Searches
from impactjax._fit.uncertainty import summarise
from impactjax._known import known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._problem.problem import Problem

_PLACE = ("sensor", "low_pass")  # of the parameters that lose their effect together


def with_faded(
    estimate: Estimate[Problem], search: Search, optimiser: LevenbergMarquardt
) -> Estimate[Problem]:
    """The likelier of an estimate and of that without the effects of parameters that fade. Its
    intervals hold both if the record does not tell which one is right. An estimate without such
    parameters, or with scatter from impact to impact, is returned as it is.
    """
    own, fades = estimate.problem, np.array([x.fades for x in estimate.problem.ranges()])
    if not fades.any() or estimate.scatter is not None or not bool(estimate.usable):
        return estimate
    filters = np.array([each.path[:2] == _PLACE for each in own.handles().values()])
    problem, nothing = own.padded(), np.array([each.low for each in own.limits()])
    values = own.recording.touches(own.names, known(estimate.values))
    places = np.where(fades, nothing, own.coordinates(values))
    parts = problem.parts(optimiser.horizons)
    searches = Searches(places, np.broadcast_to(~filters, places.shape), known(parts[-1:]))
    minima = search.minima(problem, closely(optimiser), searches)
    best = search.best_of(problem, minima, parts)
    answer = best.answer._replace(jacobian=np.where(filters, 0.0, best.answer.jacobian))
    without = summarise(problem, best._replace(answer=answer), minima.cost)
    return likelier(estimate, without.of(own))
