"""The interface of least-squares problems: residuals as a function of named parameters.

A search, a sampler or another optimiser needs `names`, `start`, `residuals(values)` and
`log_density(values)`, in the parameters' own units, and `values(u)` and `unbounded(values)`.
"""

import abc
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from impactjax._known import AnyArray, known, namespace
from impactjax._optimise.bounds import to_range, to_unbounded
from impactjax._optimise.coordinates import Limits, limits, slope, to_coordinate, to_value
from impactjax._optimise.linearisation import Linearisation, Vector, linearise, with_rows
from impactjax._parameter import Range, plain
from impactjax._problem.loss import AbstractLoss
from impactjax._problem.noise import AbstractNoise
from impactjax._problem.parameters import Handle
from impactjax._problem.prior import Normal, PriorRows, prior_rows
from impactjax._record.abstract_recording import Residuals, Valid
from impactjax._simulate.impact_log import ImpactLog
from impactjax._types import Flag, Scalar

if TYPE_CHECKING:
    from impactjax._problem.problem import Problem

Own = TypeVar("Own")
Number = Float[AnyArray, ""]


class Answer(NamedTuple):
    """Simulation compared with a recording, or several simulations with theirs."""

    residuals: Residuals  # simulated minus recorded, in the recording's SI unit; 0 if not valid
    impacts: ImpactLog  # zeros if it was not asked for
    jacobian: Float[Array, "observations parameters"] | None = None  # if it was asked for
    effect: Residuals | None = None  # derivative along the problem's direction, if it has one


class Assumed(NamedTuple):
    """Assumptions about the residuals: their loss and their noise model."""

    loss: AbstractLoss
    noise: AbstractNoise


class AbstractProblem(eqx.Module):
    """Residuals as a function of named parameters, with the assumptions about them.

    - `names`: names of the fitted parameters.
    """

    names: eqx.AbstractVar[tuple[str, ...]]

    @abc.abstractmethod
    def assumed(self) -> Assumed:
        """The assumptions about the residuals."""

    @abc.abstractmethod
    def each_recording(self) -> "list[tuple[Problem, tuple[int, ...]]]":
        """The problem of each recording, with the places of its parameters among `names`."""

    @abc.abstractmethod
    def handles(self) -> dict[str, Handle]:
        """Path and range of each fitted parameter, by name."""

    @property
    @abc.abstractmethod
    def valid(self) -> Valid:
        """Mask of the residuals that count."""

    @abc.abstractmethod
    def first(self, share: float) -> Valid:
        """Mask of the residuals that count in the first `share` of the recorded time."""

    @abc.abstractmethod
    def answer(self, values: Vector, logged: Flag | None = None) -> Answer:
        """Residuals and their Jacobian, with parameters in their natural units; if the problem has
        a direction of the factors' logarithms, also the derivative along it.

        The impact log is computed if `logged` is `None` or true when the program runs.
        """

    @abc.abstractmethod
    def joined(self, values: Vector, answers: Sequence[Answer]) -> Answer:
        """The answer of all recordings, from that of each."""

    @abc.abstractmethod
    def starting_values(self) -> list[Scalar]:
        """The values from which a search starts, in the order of `names`."""

    @abc.abstractmethod
    def residuals(self, values: Vector) -> Residuals:
        """Simulated minus recorded, in the SI unit; divided by the noise's standard deviation if
        several recordings are fitted. 0 where an observation does not count.
        """

    @abc.abstractmethod
    def variance(self) -> Number | None:
        """Variance of a residual, if it is known."""

    @abc.abstractmethod
    def is_classical(self) -> bool:
        """True for least squares under independent noise of known variance."""

    @abc.abstractmethod
    def shifted(self, rows: Residuals) -> "AbstractProblem":
        """The problem with rows subtracted from the recording; the residuals grow by them."""

    @abc.abstractmethod
    def share(self, index: int, rows: Float[AnyArray, "observations ..."]) -> AnyArray:
        """The rows of one recording, such as its residuals, in its SI unit."""

    @abc.abstractmethod
    def misfit(self, residuals: Residuals) -> Number:
        """Unexplained share of the recorded motion if the model plainly misses it; else 0."""

    @abc.abstractmethod
    def exceeds_noise(self, residuals: Residuals, impacts: ImpactLog) -> Bool[AnyArray, ""]:
        """True if the residuals of a fit are larger at its impacts than elsewhere, or larger than
        the stated noise. Its intervals then cannot be relied on.
        """

    @property
    @abc.abstractmethod
    def log_units(self) -> Number:
        """Sum of the logarithms of the units in which the residuals are given."""

    @property
    @abc.abstractmethod
    def sizes_found(self) -> int:
        """Number of noise variances that are estimated from the residuals."""

    @property
    def observations(self) -> Int[AnyArray, ""]:
        """Number of residuals that count."""
        return plain(self.valid).sum(axis=-1)

    def padded(self: Own) -> Own:
        """The problem padded with observations that do not count, so that problems of similar
        length share a compiled program. Its own observations come first.
        """
        return self

    def parts(self, shares: tuple[float, ...]) -> Bool[AnyArray, "parts observations"]:
        """Masks of the residuals that count in the first shares of the time."""
        each = [self.first(share) for share in shares]
        return namespace(*each).stack(each)

    @property
    def start(self) -> Vector:
        """The values from which a search starts, in the parameters' own units."""
        return jnp.stack([jnp.asarray(value) for value in self.starting_values()])

    def log_density(self, values: Vector) -> Scalar:
        """Log-likelihood of independent residuals and, up to a constant, log-density of priors:

        −Σ ρ(r)/σ² − n log(σ √(2 π)), with the loss ρ(r) = r²/2 for least squares,

        at the maximum-likelihood value of the noise's σ if that is not known. For least squares
        that is, up to a constant, the integral over σ with Jeffreys' prior 1/σ. −∞ where a value is
        out of range or the simulation fails.
        """
        residuals = self.residuals(values)
        n = self.observations.astype(residuals.dtype)
        cost = jnp.sum(self.assumed().loss.cost(residuals))
        variance = self.density_variance(2 * cost / n)
        density = -cost / variance - n * jnp.log(2 * jnp.pi * variance) / 2 - self.log_units
        density = density + self.prior_density(values)
        inside = [allowed.holds(values[i]) for i, allowed in enumerate(self.ranges())]
        possible = jnp.all(jnp.stack(inside)) & jnp.isfinite(density)
        return jnp.where(possible, density, -jnp.inf)

    def known_before(self) -> dict[str, Normal]:
        """Prior knowledge of parameters, by name."""
        return {}

    def prior_density(self, values: Vector) -> Scalar:
        """Logarithm of the density of prior knowledge that is not among the residuals, up to a
        constant.
        """
        return -self.prior_rows(values).squares / 2

    def prior_rows(self, values: Vector) -> PriorRows:
        """Prior knowledge that is not among the residuals, as observations of parameters."""
        return prior_rows({}, self.names, values)

    def prior_weight(self) -> Float[AnyArray, "..."] | None:
        """Variance of a residual against which prior knowledge is weighed; `None` for that of the
        residuals at each point.
        """
        return None

    @property
    def weighs_anew(self) -> bool:
        """True if prior knowledge is weighed against a variance that a fit has to find."""
        return False

    def weighed(self: Own, variance: Float[AnyArray, "..."] | None) -> Own:
        """The problem whose prior knowledge is weighed against a variance of the residuals."""
        del variance
        return self

    def remeasured(self: Own, values: Vector, key: Key[Array, ""]) -> Own:
        """The problem whose prior knowledge was measured anew, at some true values."""
        del values, key
        return self

    def of_record(self: Own) -> Own:
        """The problem without the prior knowledge that is not among the residuals. Its evaluation
        is that of all problems of the record.
        """
        return self

    def density_variance(self, most_likely: Scalar) -> Scalar:
        """Variance of a residual in `log_density`: the known one, else the most likely one."""
        known = self.variance()
        return most_likely if known is None else known

    def values(self, u: Vector) -> Vector:
        """Natural values at unbounded coordinates."""
        each = [to_range(allowed, u[i]) for i, allowed in enumerate(self.ranges())]
        return namespace(u).stack(each)

    def unbounded(
        self, values: Float[AnyArray, "... parameters"]
    ) -> Float[AnyArray, "... parameters"]:
        """Unbounded coordinates of natural values."""
        each = [to_unbounded(allowed, values[..., i]) for i, allowed in enumerate(self.ranges())]
        return namespace(values).stack(each, axis=-1)

    def at(self, u: Vector) -> Vector:
        """Natural values at coordinates of a search."""
        each = [to_value(allowed, u[i]) for i, allowed in enumerate(self.ranges())]
        return namespace(u).stack(each)

    def slopes(self, u: Vector) -> Vector:
        """Derivatives of the natural values by the coordinates of a search."""
        each = [slope(allowed, u[i]) for i, allowed in enumerate(self.ranges())]
        return namespace(u).stack(each)

    def coordinates(
        self, values: Float[AnyArray, "... parameters"]
    ) -> Float[AnyArray, "... parameters"]:
        """Coordinates of natural values in a search."""
        each = [to_coordinate(allowed, values[..., i]) for i, allowed in enumerate(self.ranges())]
        return namespace(values).stack(each, axis=-1)

    def limits(self) -> list[Limits]:
        """Limits of each coordinate of a search."""
        return [limits(allowed) for allowed in self.ranges()]

    def ranges(self) -> list[Range]:
        """The range of each parameter."""
        return [handle.allowed for handle in self.handles().values()]

    def around(self, u: Vector, answer: Answer, valid: Valid) -> Linearisation:
        """Linear model of some residuals around a point, in the coordinates of a search. Those of
        a robust loss are weighted.
        """
        assert answer.jacobian is not None
        loss = self.assumed().loss
        residuals = jnp.where(valid, answer.residuals, 0.0)
        jacobian = jnp.where(valid[:, None], answer.jacobian, 0.0) * self.slopes(u)
        weights = jnp.sqrt(loss.weight(residuals))
        cost = jnp.sum(loss.cost(residuals))
        return linearise(cost, weights * residuals, weights[:, None] * jacobian)

    def informed(self, u: Vector, model: Linearisation, count: AnyArray) -> Linearisation:
        """A linear model of `count` residuals around a point, with prior knowledge as more rows.

        With the deviations z of the priors, in units of their errors, the cost F grows by s² z²/2
        for the variance s² of `prior_weight`. If that is not known, it is 2 F/count: the minimum
        is then that of n log(F) + z² for small z²/n.
        """
        if not self.known_before():
            return model
        rows = self.prior_rows(self.at(u))
        if not rows.deviations.shape[0]:  # priors of several recordings are residuals
            return model
        variance = known(self.prior_weight())
        found = 2 * model.cost / count if variance is None else variance
        growth = 1 + rows.squares / count if variance is None else 1.0
        return with_rows(model, rows.deviations, rows.slopes * self.slopes(u), found, growth)
