"""What a fit returns."""

import dataclasses
import math
from typing import TYPE_CHECKING, Generic, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from impactjax._fit.estimate_tables import as_dataframe, as_html, as_xarray
from impactjax._fit.fitted_parameter import FittedParameter
from impactjax._fit.verdict import Verdict
from impactjax._known import AnyArray, known
from impactjax._number_format import interval, with_error
from impactjax._problem.assumptions import Rest, assumptions, given_words, rests
from impactjax._problem.problem import AbstractProblem, Problem
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog

if TYPE_CHECKING:
    import pandas
    import xarray

PerParameter = Float[AnyArray, "... parameters"]
P = TypeVar("P", bound=AbstractProblem)


class Estimate(eqx.Module, Generic[P]):
    """Parameters with their uncertainty, in the order of `names`.

    - `values`, `standard_errors`: in the parameter's own unit; of small errors, or from the profile
      where that says otherwise.
    - `inflation`: factor of the errors over those for independent residuals [1].
    - `freedom`: degrees of freedom of the errors: observations, counted as independent ones, less
      parameters; infinite if the sensor's noise is known.
    - `memory`: order of the autoregression that the residuals follow; 0 if they are independent.
    - `low`, `high`: ends of the 95 % interval; a range's end, or infinity, where it is open; NaN
      where its profile could not go on.
    - `covariance`: of the values.
    - `verdicts`: as `Verdict` numbers.
    - `residuals`: simulated minus recorded, in the recording's SI unit; 0 if not valid. Of several
      recordings in turn, each in sizes of its noise, then those of what is known beforehand.
    - `jacobian`: derivatives of the residuals by the parameters, in their own units.
    - `impacts`: the impact log of the fitted system; with an axis of recordings if
      several were fitted.
    - `rms`: root of the mean square of the residuals.
    - `aic`, `bic`: information criteria for normal residuals, of unknown size unless the
      sensor's is known.
    - `misfit`: share of the record's standard deviation that is left [1], if that is so much, and
      so little like noise, that the model plainly misses the record; else 0. Of several recordings
      the largest.
    - `converged`: whether the optimiser came to rest.
    - `iterations`: evaluations it took.
    - `start_costs`: the cost, half the sum of squares, at the end of the search from each start.
    """

    problem: P
    values: PerParameter
    standard_errors: PerParameter
    inflation: PerParameter
    freedom: Float[AnyArray, "..."]
    memory: Int[AnyArray, "..."]
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
    converged: Bool[AnyArray, "..."]
    iterations: Int[AnyArray, "..."]
    start_costs: Float[AnyArray, "... starts"]

    def of(self, problem: P) -> "Estimate[P]":
        """The estimate of a problem of which this one is that with more rows at the end."""
        count = problem.valid.shape[-1]
        if count == self.residuals.shape[-1]:
            return self
        rows = known((self.residuals, self.jacobian))
        residuals, jacobian = (jnp.asarray(x[:count]) for x in rows)
        return dataclasses.replace(self, problem=problem, residuals=residuals, jacobian=jacobian)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that were fitted."""
        return self.problem.names

    @property
    def system(self: "Estimate[Problem]") -> System:
        """Model, initial state and sensor with the fitted values."""
        return self.problem.system_with(jnp.asarray(self.values))

    @property
    def units(self) -> tuple[str, ...]:
        """The units of the fitted parameters."""
        return tuple(handle.allowed.unit for handle in self.problem.handles().values())

    @property
    def usable(self) -> Bool[AnyArray, "..."]:
        """A search that converged, on a model that does not plainly miss the record. Otherwise
        nothing is identified.
        """
        return self.converged & (self.misfit == 0)

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
        """A fitted parameter of a single fit by name, with all that is known of it."""
        self.check_single()
        i = self._place(name)
        numbers = (self.values, self.standard_errors, self.low, self.high)
        value, error, low, high = (float(np.asarray(x)[i]) for x in numbers)
        return FittedParameter(
            name, self.units[i], value, error, low, high, self.verdict(name), self.quoted(name)
        )

    @property
    def parameters(self) -> list[FittedParameter]:
        """All fitted parameters of a single fit."""
        return [self[name] for name in self.names]

    def to_dataframe(self) -> "pandas.DataFrame":
        """The fitted parameters of a single fit as a table of pandas, a row a parameter."""
        return as_dataframe(self.parameters)

    def to_xarray(self) -> "xarray.Dataset":
        """The numbers of an estimate, or of many under `vmap`, as a dataset of xarray."""
        return as_xarray(self)

    def _repr_html_(self) -> str:
        if self.shape:
            return f"<p>{self}</p>"
        return as_html(self.parameters, self._summary())

    @property
    def shape(self) -> tuple[int, ...]:
        """How many fits this holds, along each axis of a `vmap`; none of a single one."""
        return self.rms.shape

    def check_single(self) -> None:
        """Raises `ValueError` if this holds several fits."""
        if self.shape:
            raise ValueError(
                f"This estimate holds {math.prod(self.shape)} fits: take one of them, by "
                "`jax.tree.map(lambda x: x[0], estimate)`."
            )

    def verdict(self, name: str) -> Verdict:
        """What the recording tells about a parameter of a single fit."""
        self.check_single()
        if name not in self.names:
            return Verdict.FIXED
        return Verdict(int(np.asarray(self.verdicts[self.names.index(name)])))

    def quoted(self, name: str) -> str:
        """A parameter's value with its standard error; only its bound, where the recording gives it
        no more than that and the error is no measure of it. Of a single fit.
        """
        self.check_single()
        i = self.names.index(name)
        value, error = float(self.values[i]), float(self.standard_errors[i])
        told = self.verdict(name) in (Verdict.IDENTIFIED, Verdict.UNDECIDED)
        if told or error < abs(value) / 2:
            return with_error(value, error)
        allowed = self.problem.handles()[name].allowed
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
        resting = _resting(self)
        lines = [
            f"{name}{_between(self.quoted(name))}{'' if unit == '1' else f' {unit}'} "
            f"({self.verdict(name)}{given_words(resting.get(name))})"
            for name, unit in zip(self.names, self.units, strict=True)
        ]
        return "\n".join([*lines, self._summary()])

    def _summary(self) -> str:
        state = "converged" if bool(self.converged) else "not converged"
        if float(self.misfit) > 0:
            state += f", but misses the record: {100 * float(self.misfit):.0f} % of it is left"
        return f"rms residual {float(self.rms):.4g}, {state}"


def _between(quoted: str) -> str:
    """An equals sign before a value, a colon before words."""
    return f" = {quoted}" if "±" in quoted else f": {quoted}"


def _resting(estimate: Estimate) -> dict[str, Rest]:
    """The assumptions behind each value; none are listed for several recordings."""
    problem = estimate.problem
    if not isinstance(problem, Problem):
        return {}
    system = problem.system_with(jnp.asarray(estimate.values))
    assumed = assumptions(system, problem.names, ())
    return rests(system, problem.recording, problem.names, assumed)
