"""Score tests beside scatter from impact to impact."""

import numpy as np

from impactjax._fit.estimate import Estimate
from impactjax._fit.linear_scatter import around_values
from impactjax._fit.mixed_model import whitened
from impactjax._fit.score_test import Around, weighed
from impactjax._fit.search import Search
from impactjax._known import AnyArray, known
from impactjax._problem.problem import Problem


def linearised_with_scatter(estimate: Estimate[Problem], search: Search) -> Around:
    """Residuals and Jacobian of an estimate with scatter, in units of scatter and noise together:
    those of a motion without deviations, times (I + A Aᵀ s²/σ²)^(−1/2) with the derivatives A by
    the logarithms of the factors.
    """
    assert estimate.scatter is not None
    scatter = known(estimate.scatter)
    values, by = known(estimate.values), search.evaluate
    point = around_values(estimate.problem, values, scatter.logarithms, by)
    ratio = (scatter.size / known(estimate.rms)) ** 2

    def weigh(columns: AnyArray) -> AnyArray:
        return whitened(columns, point.effects, ratio)

    steady = point.residuals - point.effects @ scatter.logarithms
    return weighed(estimate, steady, np.asarray(point.jacobian), weigh)
