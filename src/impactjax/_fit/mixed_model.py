"""Linear mixed model: parameters, random effects of an unknown size, and noise of an unknown size.

With fixed effects p and random effects u, the observations are

    z = J p + A u + e,    u ~ N(0, s² I),    e ~ N(0, σ² I).

For a known ratio λ = s²/σ² the generalised least-squares estimate of p has Student's distribution.
The ratio is integrated out on a grid, weighted by the restricted likelihood. So the intervals
contain the uncertainty of both sizes.

The prior of log λ is flat where the observations can tell λ. It falls in proportion to λ where all
random effects are below the noise, and as 1/√λ where the noise is below all random effects. That of
log σ is flat. The distributions have one to two degrees of freedom less than that gives, which
makes up for the skewness of the estimated sizes. Their number, n − p − 2 + 3/(n − p) for n
observations and p parameters, was found by simulation: see `benchmarks/scatter_coverage.py`.

Source: D. A. Harville (1977), "Maximum likelihood approaches to variance component estimation",
Journal of the American Statistical Association 72, 320, for the restricted likelihood; G. E. P. Box
and G. C. Tiao (1973), "Bayesian inference in statistical analysis", chapter 5, for its integral.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from impactjax._fit.determined import determined
from impactjax._fit.quantiles import bisected, chi_squared_above, student
from impactjax._known import AnyArray, namespace
from impactjax._problem.prior import PriorRows

Vector = Float[AnyArray, " observations"]
Jacobian = Float[AnyArray, "observations parameters"]
Effects = Float[AnyArray, "observations effects"]
Columns = Float[AnyArray, "observations ..."]
Number = Float[AnyArray, ""]
PerRatio = Float[AnyArray, " ratios"]

RATIOS, _WIDE = 48, 96  # points of the grid, and of the wider one from which it is chosen
BELOW, BEYOND = 1e4, 1e16  # factors by which that extends beyond ratios 1/strongest, 1/weakest
_NEGLIGIBLE = 1e-7  # relative density at the ends of the grid
_LOST = 1e-9  # part of the random effects beside the parameters that counts as none, relative
UNTOLD = 1e-9  # that of a direction of the parameters without information
_MEDIAN = 0.5
_UNLIKELY = 1e-9  # relative weight of a ratio that does not matter
_FARTHEST = 13.0  # more than the 97.5 % quantile of Student's t with one degree of freedom


class OwnNoise(NamedTuple):
    """Knowledge of the noise apart from the observations of the model.

    - `freedom`: its degrees of freedom.
    - `squares`: its sum of squares: `freedom` times an independent estimate of σ².
    """

    freedom: Number
    squares: Number


class Observed(NamedTuple):
    """Observations of a linear mixed model.

    - `observed`, `jacobian`, `effects`: z, J and A; rows of zeros do not count.
    - `count`: number of the rows that count.
    - `own`: knowledge of the noise from elsewhere; zeros for none.
    """

    observed: Vector
    jacobian: Jacobian
    effects: Effects
    count: Number
    own: OwnNoise

    def with_prior(self, prior: PriorRows, variance: Number) -> "Observed":
        """The observations with prior knowledge, in units of noise of a variance, as more rows."""
        xp = namespace(self)
        size, more = xp.sqrt(variance), prior.deviations.shape[0]
        return self._replace(
            observed=xp.concatenate([self.observed, -size * prior.deviations]),
            jacobian=xp.concatenate([self.jacobian, size * prior.slopes]),
            effects=xp.pad(self.effects, ((0, more), (0, 0))),
        )


class MixedModel(NamedTuple):
    """The solution of a linear mixed model for each ratio of a grid.

    - `ratios`: λ = s²/σ².
    - `weights`: their posterior probabilities.
    - `values`: estimate of the parameters.
    - `scales`: scale matrix of its distribution.
    - `effects`: expectation of the random effects.
    - `squares`: sum of squares, of which σ² = squares/freedom is an estimate.
    - `freedom`: degrees of freedom.
    - `least`: λ below which the random effects are lost in the noise.
    - `determined`: mask of the parameters without a component in a direction that changes no
      observation.
    - `told`: true if the random effects have a part that the parameters do not explain.
    """

    ratios: PerRatio
    weights: PerRatio
    values: Float[AnyArray, "ratios parameters"]
    scales: Float[AnyArray, "ratios parameters parameters"]
    effects: Float[AnyArray, "ratios effects"]
    squares: PerRatio
    freedom: Number
    least: Number
    determined: Bool[AnyArray, " parameters"]
    told: Bool[AnyArray, ""]

    @property
    def value(self) -> Float[AnyArray, " parameters"]:
        """Expectation of the parameters."""
        return self.weights @ self.values

    @property
    def effect(self) -> Float[AnyArray, " effects"]:
        """Expectation of the random effects."""
        return self.weights @ self.effects

    @property
    def ratio(self) -> Number:
        """Geometric mean of λ."""
        xp = namespace(self.ratios)
        return xp.exp(self.weights @ xp.log(self.ratios))

    @property
    def noise(self) -> Number:
        """Expectation of the variance σ² of the noise."""
        return self.weights @ self.squares / self.freedom

    @property
    def expected_size(self) -> Number:
        """Root mean square of the size s of the random effects."""
        xp = namespace(self.ratios)
        return xp.sqrt(self.weights @ (self.ratios * self.squares) / self.freedom)

    @property
    def covariance(self) -> Float[AnyArray, "parameters parameters"]:
        """Scale matrices averaged over the ratios, plus the covariance of the estimates."""
        xp, away = namespace(self.values), self.values - self.value
        return xp.einsum("g,gij->ij", self.weights, self.scales) + (self.weights * away.T) @ away

    def quantile(self, level: float) -> Float[AnyArray, " parameters"]:
        """Quantile of each parameter, at a level from 0.025 to 0.975."""
        xp = namespace(self.values)
        variances = xp.diagonal(self.scales, axis1=1, axis2=2)
        errors = xp.sqrt(xp.maximum(variances, 0.0))  # not below by rounding
        likely = (self.weights > _UNLIKELY * xp.max(self.weights))[:, None]
        near = xp.where(likely, self.values, self.value)
        reach = _FARTHEST * xp.max(xp.where(likely, errors, 0.0), axis=0)

        below = student(self.freedom)

        def probability(place: Float[AnyArray, " parameters"]) -> Float[AnyArray, " parameters"]:
            return self.weights @ below((place - self.values) / xp.where(errors > 0, errors, 1.0))

        low, high = xp.min(near, axis=0) - reach, xp.max(near, axis=0) + reach
        return bisected(probability, level, low, high)

    def size(self, level: float) -> Number:
        """Quantile of the size s of the random effects; 0 if it may be lost in the noise, and
        infinite if nothing tells it.
        """
        xp = namespace(self.values)
        most, above = xp.log(self.ratios * self.squares), chi_squared_above(self.freedom)

        def probability(log_variance: Number) -> Number:
            return self.weights @ above(most - log_variance)

        ends = xp.min(most) - 20.0, xp.max(most) + 20.0
        lost = self.weights @ xp.where(self.ratios < self.least, 1.0, 0.0)
        size = xp.exp(bisected(probability, level, *ends) / 2)
        nothing = 0.0 if level < _MEDIAN else xp.inf
        return xp.where(self.told, xp.where(lost > level, 0.0, size), nothing)


class Projected(NamedTuple):
    """Observations and random effects without the part that the parameters explain."""

    basis: Jacobian  # orthonormal basis of the parameters' columns
    inverse: Float[
        AnyArray, "parameters parameters"
    ]  # from coordinates in that basis to parameters
    lengths: Float[AnyArray, " effects"]  # singular values of the rest of the random effects
    directions: Float[AnyArray, "effects effects"]  # their directions among the random effects
    parts: Float[AnyArray, " effects"]  # the observations along them
    rest: Number  # sum of squares of the observations in no such direction
    determined: Bool[AnyArray, " parameters"]  # parameters without a component in a lost direction


def mixed_model(data: Observed) -> MixedModel:
    """The solution of z = J p + A u + e for each ratio of a grid."""
    observed, jacobian, effects, count, own = data
    xp = namespace(observed, jacobian, effects)
    more = max(effects.shape[1] - effects.shape[0], 0)  # rows, so that all directions are found
    observed = xp.pad(observed, (0, more))
    jacobian, effects = (xp.pad(x, ((0, more), (0, 0))) for x in (jacobian, effects))
    part = projected(observed, jacobian, effects)
    strengths = part.lengths**2
    felt = strengths > 0
    strongest = xp.max(strengths)
    strongest = xp.where(strongest > 0, strongest, 1.0)
    weakest = xp.min(xp.where(felt, strengths, strongest))
    freedom = count - jacobian.shape[1] + own.freedom

    def log_posterior(log_ratios: PerRatio) -> tuple[PerRatio, PerRatio]:
        ratios = xp.exp(log_ratios)
        grown = 1 + ratios[:, None] * strengths
        squares = part.rest + xp.sum(part.parts**2 / grown, axis=1) + own.squares
        likelihood = -xp.sum(xp.log(grown), axis=1) / 2 - freedom * xp.log(squares) / 2
        prior = xp.log(1 - 1 / (1 + ratios * strongest)) - xp.log(1 + ratios * weakest) / 2
        return likelihood + prior, squares

    wide = xp.linspace(-xp.log(BELOW * strongest), xp.log(BEYOND / weakest), _WIDE)
    log_ratios = _around_the_peak(wide, log_posterior(wide)[0])
    ratios, (posterior, squares) = xp.exp(log_ratios), log_posterior(log_ratios)
    posterior = xp.exp(posterior - xp.max(posterior))
    grown = 1 + ratios[:, None] * strengths
    left = xp.maximum(freedom - 1 - xp.maximum(1 - 3 / freedom, 0.0), 1.0)  # by simulation
    along = part.basis.T @ effects
    turned = along @ part.directions
    mixed, shares = turned * part.lengths, ratios[:, None] / grown
    seen = part.basis.T @ observed - (shares * part.parts) @ mixed.T
    spread = xp.eye(len(seen[0])) + xp.einsum("ai,gi,bi->gab", turned, shares, turned)
    scales = part.inverse @ spread @ part.inverse.T * (squares / left)[:, None, None]
    mixed_up = xp.any(part.inverse @ along != 0, axis=1)  # with effects that nothing else tells
    return MixedModel(
        ratios,
        posterior / xp.sum(posterior),
        seen @ part.inverse.T,
        scales,
        (shares * part.parts * part.lengths) @ part.directions.T,
        squares,
        left,
        1 / strongest,
        part.determined & (xp.any(felt) | ~mixed_up),
        xp.any(felt),
    )


def _around_the_peak(
    grid: Float[AnyArray, " wide"], log_density: Float[AnyArray, " wide"]
) -> PerRatio:
    """A grid over the part of another one where a density is not negligible."""
    xp = namespace(grid)
    likely = log_density > xp.max(log_density) + np.log(_NEGLIGIBLE)
    step = grid[1] - grid[0]
    low = xp.min(xp.where(likely, grid, grid[-1])) - step
    return xp.linspace(low, xp.max(xp.where(likely, grid, grid[0])) + step, RATIOS)


def whitened(columns: Columns, effects: Effects, ratio: Number) -> Columns:
    """Columns in units of random effects and noise together: (I + λ A Aᵀ)^(−1/2) times them. With
    an infinite ratio λ nothing is left along the effects.
    """
    xp = namespace(columns, effects, ratio)
    axes, lengths, _ = xp.linalg.svd(effects, full_matrices=False)
    felt = lengths > 0
    shrunk = xp.where(felt, 1 / xp.sqrt(1 + ratio * xp.where(felt, lengths, 1.0) ** 2) - 1, 0.0)
    return columns + (axes * shrunk) @ (axes.T @ columns)


def projected(observed: Vector, jacobian: Jacobian, effects: Effects) -> Projected:
    xp = namespace(observed, jacobian, effects)
    norms = xp.linalg.norm(jacobian, axis=0)
    norms = xp.where(norms > 0, norms, 1.0)
    basis, lengths, directions = xp.linalg.svd(jacobian / norms, full_matrices=False)
    felt = lengths > UNTOLD * xp.max(lengths)
    known = determined(directions, felt) & xp.any(jacobian != 0, axis=0)
    inverse = directions.T * xp.where(felt, 1 / xp.where(felt, lengths, 1.0), 0.0) / norms[:, None]
    basis = xp.where(felt, basis, 0.0)

    def beside(columns: AnyArray) -> AnyArray:
        once = columns - basis @ (basis.T @ columns)
        return once - basis @ (basis.T @ once)  # twice, against rounding

    axes, lengths, effect_axes = xp.linalg.svd(beside(effects), full_matrices=False)
    felt = lengths > _LOST * xp.linalg.norm(effects)
    lengths, axes = xp.where(felt, lengths, 0.0), xp.where(felt, axes, 0.0)
    left = beside(observed)
    parts = axes.T @ left
    rest = xp.sum((left - axes @ parts) ** 2)
    return Projected(basis, inverse, lengths, effect_axes.T, parts, rest, known)
