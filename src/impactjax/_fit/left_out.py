"""Parameters that a fit held at a value: does the record ask for them?

The score test of Rao: with one more column c of the Jacobian, and c⊥ its part beside the fitted
parameters' columns, freeing the parameter lowers AIC by

    (c⊥ · e)² / var(c⊥ · e) − 2.

The noise model gives the variance from the residuals e without their part along c⊥. The columns are
central differences of the evaluation that the fit compiled, so that no program is compiled.

Source: C. R. Rao (1948), "Large sample tests of statistical hypotheses concerning several
parameters with applications to problems of estimation", Mathematical Proceedings of the Cambridge
Philosophical Society 44, 50.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from impactjax._fit.estimate import Estimate
from impactjax._fit.evaluation import Evaluate
from impactjax._fit.fit import best_from
from impactjax._fit.search import Search
from impactjax._fit.starts import Starts
from impactjax._known import AnyArray, is_known, known
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt
from impactjax._parameter import Range
from impactjax._problem.parameters import Handle, handles, with_values
from impactjax._problem.problem import Problem

CLEAR = 10.0  # expected fall of AIC from which a parameter is needed
_ROUNDS = 3  # fits with more and more parameters
_TESTED = ("gap", "drag", "dry_friction")  # beside those of the sensor
_FIRST = 1e-7  # first step of a difference, relative to the value, or in its unit
_CHANGE = 1e-5  # change of the record by the final step, relative to its span
_COLLINEAR = 1e-4  # length of c⊥ relative to c below which the fitted parameters can replace it

Column = Float[AnyArray, " observations"]


class HeldParameter(NamedTuple):
    """A parameter that a fit held at a value.

    - `name`, `unit`.
    - `held`: its value.
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
        """True if fitting the parameter would lower AIC clearly, by 10 or more."""
        return self.gain >= CLEAR

    def __str__(self) -> str:
        return (
            f"{self.name}: {self.value:.4g} ± {self.standard_error:.2g} {self.unit} instead of "
            f"{self.held:.4g}, AIC {-self.gain:+.0f}"
        )


class _Candidate(NamedTuple):
    """A held parameter with its column of the Jacobian."""

    name: str
    allowed: Range
    held: float
    column: Column


class _Around(NamedTuple):
    """Residuals around an estimate and their Jacobian, both with the weights of the loss."""

    residuals: Column
    jacobian: Float[AnyArray, "observations parameters"]

    def beside(self, column: Column) -> "_Around":
        """The residuals and the Jacobian with one more column, along which no residual is left."""
        rest = _beside(self.jacobian, column)
        left = self.residuals - rest * (rest @ self.residuals) / (rest @ rest)
        return _Around(left, np.concatenate([self.jacobian, column[:, None]], axis=1))


def left_out(estimate: Estimate[Problem]) -> tuple[HeldParameter, ...]:
    """The parameters that a fit held at a value, those first that would lower AIC the most.

    They are the parameters of sensor, stops and oscillator that were neither fitted nor tied. Those
    that the fitted parameters can replace, such as a mass, are not among them.

    **Arguments:**

    - `estimate`: estimate of a single fit.

    **Raises** `ValueError` for an estimate under `jit` or of many fits, and for one that did not
    converge.
    """
    candidates = _candidates(estimate, Search().evaluate)
    around = _around(estimate)
    found = [_tested(estimate, around, each) for each in candidates]
    return tuple(sorted(found, key=lambda each: -each.gain))


def with_left_out(
    estimate: Estimate[Problem],
    *,
    known: Sequence[str] = (),
    optimiser: LevenbergMarquardt = LevenbergMarquardt(),
) -> Estimate[Problem]:
    """The estimate, fitted again with the parameters that the record asks for.

    Of the parameters that `left_out` calls needed the most needed one is freed, then the most
    needed one beside it, until none is left; then the fit is repeated, from the old values. The
    new estimate is kept if its AIC is lower.

    **Arguments:**

    - `estimate`: estimate of a single fit.
    - `known`: names of parameters that were measured, and are not to be freed.
    - `optimiser`: settings of the search.

    **Raises** `ValueError` as `left_out` does.
    """
    for _ in range(_ROUNDS):
        names = [each.name for each in needed(estimate, known)]
        if not names:
            return estimate
        problem = freed(estimate, names)
        more = best_from(problem, Starts(1).lanes(problem), optimiser)
        if not (bool(more.converged) and float(more.aic) < float(estimate.aic)):
            return estimate
        estimate = more
    return estimate


def needed(
    estimate: Estimate[Problem], known: Sequence[str] = (), search: Search = Search()
) -> list[HeldParameter]:
    """The parameters to be freed together: each the most needed one beside those before it."""
    candidates = [x for x in _candidates(estimate, search.evaluate) if x.name not in known]
    around = _around(estimate)
    found: list[HeldParameter] = []
    while candidates:
        tested = [_tested(estimate, around, each) for each in candidates]
        best = max(range(len(tested)), key=lambda i: tested[i].gain)
        if not tested[best].is_needed:
            break
        found.append(tested[best])
        around = around.beside(candidates.pop(best).column)
    return found


def freed(estimate: Estimate[Problem], names: Sequence[str]) -> Problem:
    """The problem with some more parameters to fit, which starts from the estimate."""
    problem = estimate.problem
    system = estimate.system
    order = tuple(name for name in handles(system) if name in {*problem.names, *names})
    return dataclasses.replace(problem, system=system, names=order)


def _candidates(estimate: Estimate[Problem], evaluated: Evaluate) -> list[_Candidate]:
    """The held parameters of sensor, stops and oscillator, with their columns."""
    if not is_known(estimate):
        raise ValueError(
            "`left_out` needs an estimate whose numbers are known: call it outside `jit`."
        )
    estimate.check_single()
    if not bool(estimate.converged):
        raise ValueError("The fit did not converge: what it left out cannot be tested.")
    if estimate.scatter is not None:
        return []
    problem, system = estimate.problem, estimate.system
    taken = {*problem.names, *(name for name, _ in problem.ties)}
    found = []
    for name, handle in handles(system).items():
        if name not in taken and (handle.path[0] == "sensor" or handle.path[-1] in _TESTED):
            held = float(handle.get(system))
            column = _column(estimate, handle, evaluated)
            if column is not None:
                column = _root_weights(estimate) * column
                found.append(_Candidate(name, handle.allowed, held, column))
    return found


def _column(estimate: Estimate[Problem], handle: Handle, evaluated: Evaluate) -> Column | None:
    """Derivative of the residuals by a held parameter; `None` if the record does not show it."""
    problem, allowed = estimate.problem, handle.allowed
    padded, held = problem.padded(), handle.get(problem.system)
    u = jnp.asarray(problem.unbounded(known(estimate.values)))
    parts, no = jnp.asarray(padded.parts(LevenbergMarquardt().horizons)), jnp.zeros((), bool)
    count = problem.valid.shape[-1]

    def residuals(change: float) -> Column:
        # The sum has the type of `held`, so that the compiled evaluation is found again.
        system = with_values(padded.system, [handle], [held + change])
        answer = evaluated(dataclasses.replace(padded, system=system), u, parts, no)
        return np.asarray(answer.answer.residuals)[:count]

    def difference(step: float) -> Column:
        low, high = max(-step, allowed.low - float(held)), min(step, allowed.high - float(held))
        return (residuals(high) - residuals(low)) / (high - low)

    with np.errstate(all="ignore"):
        effect = float(np.max(np.abs(difference(_FIRST * (abs(float(held)) or 1.0)))))
        if not np.isfinite(effect) or effect == 0:
            return None
        lowest, highest = problem.recording.span()
        column = difference(_CHANGE * (highest - lowest) / effect)
    return column if np.all(np.isfinite(column)) else None


def _around(estimate: Estimate[Problem]) -> _Around:
    root = _root_weights(estimate)
    return _Around(root * estimate.residuals, root[:, None] * np.asarray(estimate.jacobian))


def _root_weights(estimate: Estimate[Problem]) -> Column:
    """Square roots of the weights that the loss gives to the residuals."""
    return np.sqrt(np.asarray(estimate.problem.loss.weight(jnp.asarray(estimate.residuals))))


def _tested(estimate: Estimate[Problem], around: _Around, candidate: _Candidate) -> HeldParameter:
    """The score test of one held parameter."""
    scores, column = around.residuals, candidate.column
    beside = _beside(around.jacobian, column)
    squared = beside @ beside
    if not squared > _COLLINEAR**2 * (column @ column):
        return _nothing(candidate)
    step = -(beside @ scores) / squared
    left = scores + step * beside
    variance = float(_variance(estimate.problem, left, beside))
    error, score = np.sqrt(variance) / squared, (beside @ scores) ** 2 / variance
    n = float(estimate.freedom) + len(estimate.names)
    gain = score if np.isinf(n) else n * np.log1p(score / n)
    return HeldParameter(
        candidate.name,
        candidate.allowed.unit,
        candidate.held,
        float(candidate.held + step),
        float(error),
        float(gain - 2.0),
    )


def _nothing(candidate: _Candidate) -> HeldParameter:
    """A parameter of which the record tells nothing that the fitted ones do not."""
    held = candidate.held
    return HeldParameter(candidate.name, candidate.allowed.unit, held, held, np.inf, -2.0)


def _beside(jacobian: np.ndarray, column: Column) -> Column:
    """The part of a column that the others do not explain."""
    norms = np.linalg.norm(jacobian, axis=0)
    axes = np.linalg.qr(jacobian / np.where(norms > 0, norms, 1.0))[0]
    once = column - axes @ (axes.T @ column)
    return once - axes @ (axes.T @ once)  # twice, against rounding


@eqx.filter_jit
def _variance(problem: Problem, scores: Column, column: Column) -> Float[Array, ""]:
    """Variance of the product of a column with errors that are distributed like the scores."""
    count = problem.observations.astype(scores.dtype)
    variance = problem.variance()
    if variance is not None and problem.is_classical():
        return variance * jnp.sum(column**2)
    return problem.noise.spread(scores, count, column[:, None])[0, 0]
