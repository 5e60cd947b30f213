"""Mean of repeated measurements that differ by more than their errors: the random-effects model.

Each result yᵢ with standard error sᵢ is normal around the mean μ of all conceivable repeats, with
variance sᵢ² + τ², where τ is the scatter between repeats. μ has a flat prior distribution; that of
τ is proportional to 1/(s + τ), with 1/s² the mean of 1/sᵢ². Intervals integrate over τ. For τ much
larger than the errors they become Student's for n − 1 degrees of freedom.

Source: D. J. Spiegelhalter, K. R. Abrams and J. P. Myles (2004), "Bayesian approaches to clinical
trials and health-care evaluation", section 5.7, for the model and for priors that depend on the
errors; W. G. Cochran (1954), Biometrics 10, 101, for the test.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import special

_TAIL = 0.025
_ONE = float(special.ndtr(-1.0))  # probability below the mean minus one standard deviation
_NODES = 512  # scatters of the integral, as dense as their prior distribution
_MOST = 1e6  # the largest of them, in errors and differences
_FAR = 10.0  # standard deviations to the ends of a search for a quantile
_CLOSE = 1e-6  # accuracy of a quantile in standard deviations


class RandomEffects(NamedTuple):
    """Mean over repeats, and the scatter between them.

    - `mean`: median of the distribution of μ.
    - `standard_error`: half of its central 68 %.
    - `low`, `high`: its central 95 %.
    - `between`: standard deviation τ between repeats, its median.
    - `between_low`, `between_high`: central 95 % of τ; from 0 if the errors may explain all.
    - `single_low`, `single_high`: between these lies the true value of 95 % of further repeats.
    - `chance`: probability that the errors alone make the results differ by so much or more
      (Cochran's test) [1].
    """

    mean: float
    standard_error: float
    low: float
    high: float
    between: float
    between_low: float
    between_high: float
    single_low: float
    single_high: float
    chance: float


class _Mixture(NamedTuple):
    """A mixture of normal distributions."""

    weights: np.ndarray
    means: np.ndarray
    deviations: np.ndarray

    def quantile(self, level: float) -> float:
        from scipy import optimize  # imported only when needed

        def missing(place: float) -> float:
            below = special.ndtr((place - self.means) / self.deviations)
            return float(np.sum(self.weights * below)) - level

        reach = _FAR * self.deviations
        low, high = np.min(self.means - reach), np.max(self.means + reach)
        close = _CLOSE * float(np.min(self.deviations))
        return optimize.root_scalar(missing, bracket=(low, high), xtol=close).root


def random_effects(
    values: Float[np.ndarray, " repeats"], errors: Float[np.ndarray, " repeats"]
) -> RandomEffects:
    """The random-effects model of results with their standard errors.

    **Raises** `ValueError` for fewer than two results, and for an error that is not positive and
    finite.
    """
    if len(values) < 2:
        raise ValueError("A mean over repeats needs at least two results.")
    if not np.all((errors > 0) & np.isfinite(errors)):
        raise ValueError(f"Standard errors must be positive and finite, but they are {errors}.")
    unit = np.sqrt(1 / np.mean(1 / errors**2))
    most = _MOST * (1 + np.ptp(values) / unit)
    between = unit * np.expm1(np.log1p(most) * (np.arange(_NODES) + 0.5) / _NODES)
    weights = 1 / (errors**2 + between[:, None] ** 2)
    variances = 1 / np.sum(weights, axis=1)
    means = variances * np.sum(weights * values, axis=1)
    squares = np.sum(weights * (values - means[:, None]) ** 2, axis=1)
    logs = (np.sum(np.log(weights), axis=1) + np.log(variances) - squares) / 2
    density = np.exp(logs - np.max(logs))
    density /= np.sum(density)
    middle = _Mixture(density, means, np.sqrt(variances))
    single = _Mixture(density, means, np.sqrt(variances + between**2))
    below = np.cumsum(density) - density / 2
    size, least, largest = np.interp([0.5, _TAIL, 1 - _TAIL], below, between)
    alone = 1 / errors**2
    differences = np.sum(alone * (values - np.sum(alone * values) / np.sum(alone)) ** 2)
    chance = float(special.chdtrc(len(values) - 1, differences))
    return RandomEffects(
        middle.quantile(0.5),
        (middle.quantile(1 - _ONE) - middle.quantile(_ONE)) / 2,
        middle.quantile(_TAIL),
        middle.quantile(1 - _TAIL),
        float(size),
        0.0 if chance > _TAIL else float(least),
        float(largest),
        single.quantile(_TAIL),
        single.quantile(1 - _TAIL),
        chance,
    )
