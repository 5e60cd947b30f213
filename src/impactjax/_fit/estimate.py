"""Result of a fit: parameters with their uncertainty."""

import dataclasses
import math
from typing import TYPE_CHECKING, Generic, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from impactjax._fit.estimate_tables import as_dataframe, as_html, as_xarray
from impactjax._fit.fitted_parameter import FittedParameter
from impactjax._fit.reason import Reason, reasons
from impactjax._fit.scatter_found import Scatter
from impactjax._fit.used_prior import UsedPrior, prior_words
from impactjax._fit.verdict import Verdict
from impactjax._known import AnyArray, known
from impactjax._number_format import interval, with_error
from impactjax._optimise.coordinates import FARTHEST
from impactjax._outcome import Outcome
from impactjax._problem.abstract_problem import AbstractProblem
from impactjax._problem.assumptions import Rest, assumptions, given_words, rests
from impactjax._problem.failure import failure
from impactjax._problem.single_problem import AbstractSingleProblem, Fitted
from impactjax._simulate.impact_log import ImpactLog

if TYPE_CHECKING:
    import pandas
    import xarray

PerParameter = Float[AnyArray, "... parameters"]
P = TypeVar("P", bound=AbstractProblem)
Posed = TypeVar("Posed", bound=AbstractProblem, covariant=True)


class Estimate(eqx.Module, Generic[Posed]):
    """Parameters with their uncertainty, in the order of `names`.

    - `values`, `standard_errors`: in the parameter's own unit. The errors are linearised, or agree
      with the profile likelihood where the two differ clearly.
    - `inflation`: ratio of the errors to those for independent residuals [1].
    - `freedom`: degrees of freedom: effective number of independent observations minus parameters;
      infinite if the sensor's noise is known.
    - `memory`: order of the residuals' autoregression; 0 if they are independent.
    - `lasting`: true if the residuals are autocorrelated over longer times than in the noise model.
      Errors and intervals are then too small, and no parameter is identified.
    - `exceeds_noise`: true if the residuals are larger at impacts than elsewhere, by a factor of 2,
      or than the stated noise, by 1.5: law or sensor is wrong, and no parameter is identified.
    - `low`, `high`: ends of the 95 % interval; the end of the range, or infinity, if that side is
      open; NaN if the profile could not be completed.
    - `covariance`: covariance matrix of the values.
    - `verdicts`: `Verdict` numbers.
    - `residuals`: simulated minus recorded, in the recording's SI unit; 0 if not valid. For several
      recordings: those of each in turn, divided by its noise, then those of the priors.
    - `jacobian`: derivatives of the residuals by the parameters, in their own units.
    - `impacts`: impact log of the fitted system; with an axis of recordings if several were fitted.
    - `rms`: root mean square of the residuals.
    - `aic`, `bic`: information criteria for normal residuals, of unknown variance unless the
      sensor's is known.
    - `misfit`: unexplained share of the record's standard deviation [1] if the model plainly misses
      the record; else 0. For several recordings, the largest.
    - `outcome`: `Outcome` number: convergence, or the cause of failure.
    - `iterations`: number of evaluations.
    - `scatter`: scatter of the speed after an impact from impact to impact; `None` if the fit
      assumed none.
    - `start_costs`: cost, half the sum of squares, at the end of the search from each start.

    Source: H. Akaike (1974), IEEE Transactions on Automatic Control 19, 716, for AIC; G. Schwarz
    (1978), Annals of Statistics 6, 461, for BIC.
    """

    problem: Posed
    values: PerParameter
    standard_errors: PerParameter
    inflation: PerParameter
    freedom: Float[AnyArray, "..."]
    memory: Int[AnyArray, "..."]
    lasting: Bool[AnyArray, "..."]
    exceeds_noise: Bool[AnyArray, "..."]
    low: PerParameter
    high: PerParameter
    covariance: Float[AnyArray, "... parameters parameters"]
    verdicts: Int[AnyArray, "... parameters"]
    residuals: Float[AnyArray, "... observations"]
    jacobian: Float[AnyArray, "... observations parameters"]
    impacts: ImpactLog
    rms: Float[AnyArray, "..."]
    aic: Float[AnyArray, "..."]
    bic: Float[AnyArray, "..."]
    misfit: Float[AnyArray, "..."]
    outcome: Int[AnyArray, "..."]
    iterations: Int[AnyArray, "..."]
    start_costs: Float[AnyArray, "... starts"]
    scatter: Scatter | None = None

    def of(self: "Estimate[P]", problem: P) -> "Estimate[P]":
        """The estimate of the unpadded problem; the rows of this one end with padding."""
        problem = problem.weighed(self.problem.prior_weight())
        count = problem.valid.shape[-1]
        if count == self.residuals.shape[-1]:
            return dataclasses.replace(self, problem=problem)
        residuals, jacobian = (x[:count] for x in known((self.residuals, self.jacobian)))
        own = dataclasses.replace(self, problem=problem, residuals=residuals, jacobian=jacobian)
        if self.scatter is None:
            return own
        return dataclasses.replace(own, scatter=self.scatter.shortened(count))

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that were fitted."""
        return self.problem.names

    @property
    def system(self: "Estimate[AbstractSingleProblem[Fitted]]") -> Fitted:
        """Model, initial state and sensor with the fitted values; of `fit_data`, the part."""
        return self.problem.system_with(known(self.values))

    @property
    def units(self) -> tuple[str, ...]:
        """The units of the fitted parameters."""
        return tuple(handle.allowed.unit for handle in self.problem.handles().values())

    @property
    def converged(self) -> Bool[AnyArray, "..."]:
        """True if the search converged."""
        return self.outcome == Outcome.CONVERGED

    @property
    def usable(self) -> Bool[AnyArray, "..."]:
        """True if the search converged and the model does not plainly miss the record. If not, no
        parameter is identified.
        """
        return self.converged & (self.misfit == 0)

    @property
    def cause(self) -> str:
        """The outcome of a single fit in words: "converged", or why it has no usable result."""
        self.check_single()
        outcome = Outcome(int(np.asarray(self.outcome)))
        if outcome is Outcome.NOT_SIMULATED:
            return f"not simulated: {failure(self.problem)}"
        if outcome is not Outcome.CONVERGED:
            return f"not converged: {outcome}"
        if float(self.misfit) > 0:
            return f"misses the record: {100 * float(self.misfit):.0f} % of its motion is left"
        return "converged"

    @property
    def doubtful(self) -> Bool[AnyArray, "..."]:
        """True if the residuals are not the noise that intervals assume: no value is identified."""
        return self.lasting | self.exceeds_noise

    @property
    def independent_observations(self) -> float:
        """Effective sample size of a single fit: degrees of freedom plus the numbers estimated."""
        self.check_single()
        scatter = 0 if self.scatter is None else 2  # a size takes up to two degrees of freedom
        found = float(self.freedom) + len(self.names) + scatter
        return min(found, float(self.problem.observations))

    @property
    def correlation(self) -> Float[AnyArray, "... parameters parameters"]:
        """Correlation matrix of the values."""
        scale = self.standard_errors
        return self.covariance / (scale[..., :, None] * scale[..., None, :])

    def value(self, name: str) -> Float[AnyArray, "..."]:
        """The value of a fitted parameter by name."""
        return self.values[..., self._place(name)]

    def standard_error(self, name: str) -> Float[AnyArray, "..."]:
        """The standard error of a fitted parameter by name."""
        return self.standard_errors[..., self._place(name)]

    def _place(self, name: str) -> int:
        if name not in self.names:
            raise ValueError(f"`{name}` was not fitted; {', '.join(self.names)} were.")
        return self.names.index(name)

    def __getitem__(self, name: str) -> FittedParameter:
        """A fitted parameter of a single fit by name, with its uncertainty."""
        self.check_single()
        i = self._place(name)
        numbers = (self.values, self.standard_errors, self.low, self.high)
        value, error, low, high = (float(np.asarray(x)[i]) for x in numbers)
        return FittedParameter(
            name, self.units[i], value, error, low, high, self.verdict(name), self.quoted(name)
        )

    @property
    def priors(self) -> dict[str, UsedPrior]:
        """Prior knowledge that a single fit used, by the parameter's name."""
        known, found = self.problem.known_before(), {}
        for name, prior in known.items():
            own, mean, sigma = self[name], float(prior.mean), float(prior.sigma)
            found[name] = UsedPrior(name, own.unit, mean, sigma, own.value, own.standard_error)
        return found

    @property
    def parameters(self) -> list[FittedParameter]:
        """All fitted parameters of a single fit."""
        return [self[name] for name in self.names]

    def to_dataframe(self) -> "pandas.DataFrame":
        """The fitted parameters of a single fit as a pandas data frame, one row for each."""
        return as_dataframe(self.parameters)

    def to_xarray(self) -> "xarray.Dataset":
        """The numbers of an estimate, or of many under `vmap`, as an xarray dataset."""
        return as_xarray(self)

    def _repr_html_(self) -> str:
        if self.shape:
            return f"<p>{self}</p>"
        return as_html(self.parameters, self._summary())

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of fits along each axis of a `vmap`; `()` for a single fit."""
        return self.rms.shape

    def check_single(self) -> None:
        """Raises `ValueError` if this holds several fits."""
        if self.shape:
            raise ValueError(
                f"This estimate holds {math.prod(self.shape)} fits: take one of them, by "
                "`jax.tree.map(lambda x: x[0], estimate)`."
            )

    def verdict(self, name: str) -> Verdict:
        """The verdict on a parameter of a single fit: from which sides it is bounded."""
        self.check_single()
        if name not in self.names:
            return Verdict.FIXED
        return Verdict(int(np.asarray(self.verdicts[self.names.index(name)])))

    def reason(self, name: str) -> Reason:
        """The reason of the verdict on a parameter of a single fit."""
        self.check_single()
        if name not in self.names:
            return Reason.FIXED
        return Reason(int(np.asarray(reasons(self))[self.names.index(name)]))

    def quoted(self, name: str) -> str:
        """A parameter of a single fit as text: its value with its standard error, "0.71 ± 0.02".

        If the parameter is not bounded from both sides, and its error exceeds half its value, or it
        has no effect, the bound instead: "less than 0.0056".
        """
        self.check_single()
        i = self.names.index(name)
        value, error = float(self.values[i]), float(self.standard_errors[i])
        told = self.verdict(name) in (Verdict.IDENTIFIED, Verdict.UNDECIDED)
        allowed = self.problem.handles()[name].allowed
        vanishes = allowed.fades and value >= FARTHEST
        if told or (error < abs(value) / 2 and not vanishes):
            return with_error(value, error)
        low, high = float(self.low[i]), float(self.high[i])
        low, high = (
            low if low > allowed.low else -math.inf,
            high if high < allowed.high else math.inf,
        )
        return interval(low, high, error)

    def __str__(self) -> str:
        if self.shape:
            return (
                f"{math.prod(self.shape)} fits of {', '.join(self.names)}: "
                f"{int(self.converged.sum())} converged, {int(self.usable.sum())} of them describe "
                "their record"
            )
        resting, priors = _resting(self), self.priors
        lines = [
            f"{name}{_between(self.quoted(name))}{'' if unit == '1' else f' {unit}'} "
            f"({self.verdict(name)}{given_words(resting.get(name))}{prior_words(priors.get(name))})"
            for name, unit in zip(self.names, self.units, strict=True)
        ]
        scatter = [] if self.scatter is None else [str(self.scatter)]
        return "\n".join([*lines, *scatter, self._summary()])

    def _summary(self) -> str:
        return f"rms residual {float(self.rms):.4g}, {self.cause}"


def _between(quoted: str) -> str:
    """The text after an equals sign if it is a value, after a colon if it is words."""
    return f" = {quoted}" if "±" in quoted else f": {quoted}"


def _resting(estimate: Estimate[P]) -> dict[str, Rest]:
    """The assumptions behind each value, by name."""
    found: dict[str, Rest] = {}
    for problem, places in estimate.problem.each_recording():
        system = problem.system_with(jnp.asarray(estimate.values)[jnp.array(places)])
        assumed = assumptions(system, problem.names, ())
        own = rests(system, problem.recording, problem.names, assumed)
        joint = {name: estimate.names[i] for name, i in zip(problem.names, places, strict=True)}
        found |= {joint[name]: rest for name, rest in own.items()}
    return found
