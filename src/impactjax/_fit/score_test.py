"""The score test of a parameter that a fit held at a value.

With one more column c of the Jacobian, and c⊥ its part beside the fitted parameters' columns,
freeing the parameter lowers AIC by

    n log(1 + (c⊥ · e)² / (n var(c⊥ · e))) − 2

with the effective number n of observations. The noise model gives the variance from the residuals e
without their part along c⊥.

Source: C. R. Rao (1948), "Large sample tests of statistical hypotheses concerning several
parameters with applications to problems of estimation", Mathematical Proceedings of the Cambridge
Philosophical Society 44, 50.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from impactjax._fit.estimate import Estimate
from impactjax._known import AnyArray, known
from impactjax._number_format import with_error, with_unit
from impactjax._problem.problem import Problem
from impactjax._sensor.low_pass import Butterworth

CLEAR = 10.0  # expected fall of AIC from which a parameter is needed
_COST = 2.0  # AIC counts a parameter twice
_WHOLE = (0.5, 2.0)  # share of a filter's effect that counts as the whole
_COLLINEAR = 1e-4  # length of c⊥ relative to c below which the fitted parameters can replace it

Column = Float[AnyArray, " observations"]


class HeldParameter(NamedTuple):
    """A parameter that a fit held at a value.

    - `name`, `unit`.
    - `held`: its value; infinite for a low-pass or a friction that was not assumed.
    - `value`, `standard_error`: estimate if it were fitted, in linear approximation.
    - `gain`: expected fall of AIC if it were fitted.
    """

    name: str
    unit: str
    held: float
    value: float
    standard_error: float
    gain: float

    @property
    def is_needed(self) -> bool:
        """True if fitting the parameter is expected to lower AIC clearly, by 10 or more."""
        return self.gain >= CLEAR

    def __str__(self) -> str:
        value = with_unit(with_error(self.value, self.standard_error), self.unit)
        return f"{self.name} = {value} instead of {self.instead}, AIC {-self.gain:+.0f}"

    @property
    def instead(self) -> str:
        """The held value as text."""
        return "none" if math.isinf(self.held) else f"{self.held:.4g}"


class Candidate(NamedTuple):
    """A held parameter with its column of the Jacobian.

    For a `low_pass` that was not assumed the column is the change of the record by it.
    """

    name: str
    unit: str
    held: float
    column: Column
    low_pass: Butterworth | None = None

    def found(self, step: float, error: float, gain: float) -> HeldParameter | None:
        """The parameter with an estimate, which is a step away from the held value; `None` if the
        record does not show about the whole effect of the low-pass.
        """
        if self.low_pass is None:
            return HeldParameter(self.name, self.unit, self.held, self.held + step, error, gain)
        if not _WHOLE[0] < step < _WHOLE[1]:
            return None
        cutoff = float(self.low_pass.cutoff)
        return HeldParameter(self.name, self.unit, self.held, cutoff, math.nan, gain)


class Around(NamedTuple):
    """Weighed residuals around an estimate and their Jacobian. The last rows are those of prior
    knowledge, in units of the residuals.

    - `observed`: number of the rows before.
    - `weigh`: gives columns of the record their weights, those of the loss or of scatter.
    """

    residuals: Column
    jacobian: Float[AnyArray, "observations parameters"]
    observed: int
    weigh: Callable[[AnyArray], AnyArray]

    def whole(self, column: Float[AnyArray, " record"]) -> Float[AnyArray, " rows"]:
        """A weighed column of the record, with the zeros that a parameter without a prior has."""
        return np.pad(self.weigh(column), (0, len(self.residuals) - self.observed))

    def effect(self, column: Column) -> Float[AnyArray, " parameters"]:
        """Derivatives of the fitted values by a parameter that is held, from its column."""
        return -np.linalg.lstsq(self.jacobian, self.whole(column))[0]

    def beside(self, column: Column) -> "Around":
        """The residuals and the Jacobian with one more column, along which no residual is left."""
        column = self.whole(column)
        rest = _beside(self.jacobian, column)
        left = self.residuals - rest * (rest @ self.residuals) / (rest @ rest)
        jacobian = np.concatenate([self.jacobian, column[:, None]], axis=1)
        return self._replace(residuals=left, jacobian=jacobian)


def linearised(estimate: Estimate[Problem]) -> Around:
    """Residuals and Jacobian of an estimate, with the weights of the loss."""
    residuals = known(estimate.residuals)
    root = np.sqrt(known(known(estimate.problem.loss).weight(residuals)))

    def weigh(columns: AnyArray) -> AnyArray:
        return (root * columns.T).T

    return weighed(estimate, residuals, np.asarray(estimate.jacobian), weigh)


def weighed(
    estimate: Estimate[Problem],
    residuals: Column,
    jacobian: Float[AnyArray, "observations parameters"],
    weigh: Callable[[AnyArray], AnyArray],
) -> Around:
    """Residuals and Jacobian with weights, and with the rows of prior knowledge."""
    rows, weight = estimate.problem.prior_rows(np.asarray(estimate.values)), root_prior(estimate)
    return Around(
        np.concatenate([weigh(residuals), weight * rows.deviations]),
        np.concatenate([weigh(jacobian), weight * rows.slopes]),
        len(residuals),
        weigh,
    )


def root_prior(estimate: Estimate[Problem]) -> float:
    """Size of a residual against which prior knowledge is weighed; 1 if there is none."""
    weight = estimate.problem.prior_weight()
    return 1.0 if weight is None else math.sqrt(float(weight))


def tested(
    estimate: Estimate[Problem], around: Around, candidate: Candidate
) -> HeldParameter | None:
    """The score test of one held parameter; `None` if the fitted parameters can replace it."""
    scores, column = around.residuals, around.whole(candidate.column)
    beside = _beside(around.jacobian, column)
    squared = beside @ beside
    if not squared > _COLLINEAR**2 * (column @ column):
        return None
    step = -(beside @ scores) / squared
    left = scores + step * beside
    own, prior = np.split(beside, [around.observed])
    variance = _variance(estimate.problem, left[: around.observed], own)
    variance += root_prior(estimate) ** 2 * float(prior @ prior)
    error, score = np.sqrt(variance) / squared, (beside @ scores) ** 2 / variance
    n = float(estimate.freedom) + len(estimate.names)
    gain = score if np.isinf(n) else n * np.log1p(score / n)
    return candidate.found(float(step), float(error), float(gain - _COST))


def _beside(jacobian: np.ndarray, column: Column) -> Column:
    """The part of a column that the others do not explain."""
    norms = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(norms > 0, norms, 1.0)
    once = column - scaled @ np.linalg.lstsq(scaled, column)[0]
    return once - scaled @ np.linalg.lstsq(scaled, once)[0]  # twice, against rounding


def _variance(problem: Problem, scores: Column, column: Column) -> float:
    """Variance of the product of a column with errors that are distributed like the scores."""
    count, variance = problem.observations.astype(scores.dtype), problem.variance()
    if variance is not None and problem.is_classical():
        return float(variance) * float(column @ column)
    return float(problem.noise.spread(scores, count, column[:, None])[0, 0])
