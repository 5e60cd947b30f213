"""What a fit returns."""

import math
from typing import Generic, TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from impactjax._fit.digits import interval, with_error
from impactjax._fit.problem import AbstractProblem, Problem
from impactjax._fit.system import System
from impactjax._fit.verdict import Verdict
from impactjax._simulate.impact_log import ImpactLog
from impactjax._types import Scalar

PerParameter = Float[Array, "... parameters"]
P = TypeVar("P", bound=AbstractProblem)


class Estimate(eqx.Module, Generic[P]):
    """Parameters with their uncertainty, in the order of `names`.

    - `values`, `standard_errors`: in the parameter's own unit.
    - `inflation`: factor of the errors over those for independent residuals [1].
    - `freedom`: degrees of freedom of the errors: observations, counted as independent ones, less
      parameters; infinite if the sensor's noise is known.
    - `memory`: order of the autoregression that the residuals follow; 0 if they are independent.
    - `low`, `high`: ends of the 95 % interval; a range's end, or infinity, where it is open.
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
    - `converged`: whether the optimiser came to rest.
    - `iterations`: evaluations it took.
    - `start_costs`: the cost, half the sum of squares, at the end of the search from each start.
    """

    problem: P
    values: PerParameter
    standard_errors: PerParameter
    inflation: PerParameter
    freedom: Float[Array, "..."]
    memory: Int[Array, "..."]
    low: PerParameter
    high: PerParameter
    covariance: Float[Array, "... parameters parameters"]
    verdicts: Int[Array, "... parameters"]
    residuals: Float[Array, "... observations"]
    jacobian: Float[Array, "... observations parameters"]
    impacts: ImpactLog
    rms: Float[Array, "..."]
    aic: Float[Array, "..."]
    bic: Float[Array, "..."]
    converged: Bool[Array, "..."]
    iterations: Int[Array, "..."]
    start_costs: Float[Array, "... starts"]

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that were fitted."""
        return self.problem.names

    @property
    def system(self: "Estimate[Problem]") -> System:
        """Model, initial state and sensor with the fitted values."""
        return self.problem.system_with(self.values)

    @property
    def units(self) -> tuple[str, ...]:
        """The units of the fitted parameters."""
        return tuple(handle.allowed.unit for handle in self.problem.handles().values())

    @property
    def correlation(self) -> Float[Array, "... parameters parameters"]:
        """Correlation matrix of the values."""
        scale = self.standard_errors
        return self.covariance / (scale[..., :, None] * scale[..., None, :])

    def value(self, name: str) -> Scalar:
        """The value of a fitted parameter by name."""
        return self.values[..., self._place(name)]

    def standard_error(self, name: str) -> Scalar:
        """The standard error of a fitted parameter by name."""
        return self.standard_errors[..., self._place(name)]

    def _place(self, name: str) -> int:
        if name not in self.names:
            raise ValueError(f"`{name}` was not fitted; {', '.join(self.names)} were.")
        return self.names.index(name)

    def verdict(self, name: str) -> Verdict:
        """What the recording tells about a parameter of a single fit."""
        if name not in self.names:
            return Verdict.FIXED
        return Verdict(int(np.asarray(self.verdicts[self.names.index(name)])))

    def quoted(self, name: str) -> str:
        """A parameter's value with its standard error; only its bound, where the recording gives it
        no more than that and the error is no measure of it. Of a single fit.
        """
        i = self.names.index(name)
        value, error = float(self.values[i]), float(self.standard_errors[i])
        if self.verdict(name) is Verdict.IDENTIFIED or error < abs(value) / 2:
            return with_error(value, error)
        allowed = self.problem.handles()[name].allowed
        low, high = float(self.low[i]), float(self.high[i])
        low, high = (
            low if low > allowed.low else -math.inf,
            high if high < allowed.high else math.inf,
        )
        return interval(low, high, error)

    def __str__(self) -> str:
        lines = [
            f"{name}{_between(self.quoted(name))}{'' if unit == '1' else f' {unit}'} "
            f"({self.verdict(name)})"
            for name, unit in zip(self.names, self.units, strict=True)
        ]
        state = "converged" if bool(self.converged) else "not converged"
        return "\n".join([*lines, f"rms residual {float(self.rms):.4g}, {state}"])


def _between(quoted: str) -> str:
    """An equals sign before a value, a colon before words."""
    return f" = {quoted}" if "±" in quoted else f": {quoted}"
