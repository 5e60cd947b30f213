"""Residuals of a system against a recording, as a function of named parameters.

A problem is all that a search, a sampler or another optimiser needs: `names`, `start`,
`residuals(values)` and `log_density(values)` in the parameters' own units, and `values(u)` and
`unbounded(values)` between these and unbounded coordinates.
"""

import abc
import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from impactjax._known import AnyArray, namespace
from impactjax._optimise.bounds import slope, to_range, to_unbounded
from impactjax._optimise.minimiser import Matrix, Quadratic, Vector
from impactjax._parameter import Range
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.misfit import misfit
from impactjax._problem.noise import AbstractNoise, AutoregressiveNoise
from impactjax._problem.parameters import Handle, handles, replaced
from impactjax._record.abstract_recording import AbstractRecording, Residuals, Valid
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulation import Simulation
from impactjax._types import Flag, Scalar

Own = TypeVar("Own")
Tie = Callable[[Mapping[str, Scalar]], ArrayLike]


class Answer(NamedTuple):
    """What a simulation says about a recording, or several about theirs."""

    residuals: Residuals  # simulated minus recorded, in the recording's SI unit; 0 if not valid
    impacts: ImpactLog  # zeros if it was not asked for
    jacobian: Float[Array, "observations parameters"] | None = None  # if it was asked for


class Assumed(NamedTuple):
    """How much a residual counts, and how residuals vary from record to record."""

    loss: AbstractLoss
    noise: AbstractNoise


class AbstractProblem(eqx.Module):
    """Residuals as a function of named parameters, and what is assumed of them.

    - `names`: of the parameters to be found.
    """

    names: eqx.AbstractVar[tuple[str, ...]]

    @abc.abstractmethod
    def assumed(self) -> Assumed:
        """The assumptions about the residuals."""

    @abc.abstractmethod
    def handles(self) -> dict[str, Handle]:
        """What each of the parameters to be found may be, and where it is."""

    @property
    @abc.abstractmethod
    def valid(self) -> Valid:
        """Which residuals count."""

    @abc.abstractmethod
    def first(self, share: float) -> Valid:
        """Which residuals count in the first part of the time."""

    @abc.abstractmethod
    def answer(self, values: Vector, logged: Flag | None = None) -> Answer:
        """Residuals and their Jacobian with parameters in their natural units; with the impact log
        unless a program is to find out as it runs whether it is wanted, and it is not.
        """

    @abc.abstractmethod
    def starting_values(self) -> list[Scalar]:
        """The value of each parameter from which a search starts."""

    @abc.abstractmethod
    def residuals(self, values: Vector) -> Residuals:
        """Simulated minus recorded in the SI unit, or in sizes of the noise if several recordings
        are fitted; 0 where an observation does not count.
        """

    @abc.abstractmethod
    def variance(self) -> Scalar | None:
        """Variance of a residual, if it is known."""

    @abc.abstractmethod
    def is_classical(self) -> bool:
        """Whether the errors are those of least squares under independent noise of known size."""

    @abc.abstractmethod
    def shifted(self, rows: Residuals) -> "AbstractProblem":
        """The problem with so much taken from what was recorded: the residuals grow by it."""

    @abc.abstractmethod
    def misfit(self, residuals: Residuals) -> Scalar:
        """Share of the recorded motion that is left where the model plainly misses it; else 0."""

    @property
    @abc.abstractmethod
    def log_units(self) -> Scalar:
        """Sum of the logarithms of the units in which the residuals are given."""

    @property
    @abc.abstractmethod
    def sizes_found(self) -> int:
        """How many sizes of noise are found from the residuals."""

    @property
    def observations(self) -> Int[Array, ""]:
        """How many residuals count."""
        return jnp.sum(self.valid, axis=-1)

    def padded(self: Own) -> Own:
        """The problem with observations that do not count, so that similar ones share a program;
        the first ones are its own.
        """
        return self

    def parts(self, shares: tuple[float, ...]) -> Bool[AnyArray, "parts observations"]:
        """Which residuals count in each first part of the time."""
        each = [self.first(share) for share in shares]
        return namespace(*each).stack(each)

    @property
    def start(self) -> Vector:
        """The values from which a search starts, in the parameters' own units."""
        return jnp.stack([jnp.asarray(value) for value in self.starting_values()])

    def log_density(self, values: Vector) -> Scalar:
        """Logarithm of the likelihood of independent residuals, and of prior densities:

        −Σ ρ(r)/σ² − n log(σ √(2 π)), with the loss ρ(r) = r²/2 for least squares,

        at the most likely size σ of the noise where that is not known. −∞ where a value is out of
        range or nothing can be simulated.
        """
        residuals = self.residuals(values)
        n = self.observations.astype(residuals.dtype)
        cost = jnp.sum(self.assumed().loss.cost(residuals))
        known = self.variance()
        variance = 2 * cost / n if known is None else known
        density = -cost / variance - n * jnp.log(2 * jnp.pi * variance) / 2 - self.log_units
        inside = [allowed.holds(values[i]) for i, allowed in enumerate(self._ranges())]
        possible = jnp.all(jnp.stack(inside)) & jnp.isfinite(density)
        return jnp.where(possible, density, -jnp.inf)

    def values(self, u: Vector) -> Vector:
        """Natural values from the optimiser's unbounded numbers."""
        each = [to_range(allowed, u[i]) for i, allowed in enumerate(self._ranges())]
        return namespace(u).stack(each)

    def slopes(self, u: Vector) -> Vector:
        """Derivatives of the natural values by the optimiser's numbers."""
        each = [slope(allowed, u[i]) for i, allowed in enumerate(self._ranges())]
        return namespace(u).stack(each)

    def unbounded(
        self, values: Float[AnyArray, "... parameters"]
    ) -> Float[AnyArray, "... parameters"]:
        """The optimiser's numbers that stand for natural values."""
        each = [to_unbounded(allowed, values[..., i]) for i, allowed in enumerate(self._ranges())]
        return namespace(values).stack(each, axis=-1)

    def _ranges(self) -> list[Range]:
        return [handle.allowed for handle in self.handles().values()]

    def around(self, u: Vector, answer: Answer, valid: Valid) -> Quadratic:
        """The cost of some of the residuals around a point, in the optimiser's coordinates."""
        assert answer.jacobian is not None
        some = answer._replace(
            residuals=jnp.where(valid, answer.residuals, 0.0),
            jacobian=jnp.where(valid[:, None], answer.jacobian, 0.0),
        )
        cost, gradient, curvature = around(self.assumed().loss, some)
        slopes = self.slopes(u)
        return Quadratic(cost, gradient * slopes, curvature * slopes[:, None] * slopes[None, :])


def around(loss: AbstractLoss, answer: Answer) -> tuple[Scalar, Vector, Matrix]:
    """The cost of some residuals, its gradient, and Gauss and Newton's curvature."""
    residuals, jacobian = answer.residuals, answer.jacobian
    assert jacobian is not None
    weighted = loss.weight(residuals)[:, None] * jacobian
    return jnp.sum(loss.cost(residuals)), weighted.T @ residuals, weighted.T @ jacobian


class Problem(AbstractProblem):
    """A recording, a system, which of its parameters are to be found, and what is assumed.

    - `ties`: parameters that follow from the others, by name.
    - `bounds`: limits of parameters inside their own range, by name.
    """

    system: System
    recording: AbstractRecording
    names: tuple[str, ...] = eqx.field(static=True)
    simulation: Simulation = Simulation()
    loss: AbstractLoss = Squares()
    noise: AbstractNoise = AutoregressiveNoise()
    ties: tuple[tuple[str, Tie], ...] = eqx.field(static=True, default=())
    bounds: tuple[tuple[str, tuple[float, float]], ...] = eqx.field(static=True, default=())

    def __check_init__(self) -> None:
        if not self.names:
            raise ValueError("No parameter is left to fit; all are fixed.")

    def assumed(self) -> Assumed:
        return Assumed(self.loss, self.noise)

    def handles(self) -> dict[str, Handle]:
        known = handles(self.system)
        for name, (low, high) in self.bounds:
            known[name] = known[name].within(low, high)
        return {name: known[name] for name in self.names}

    @property
    def valid(self) -> Valid:
        return self.recording.valid

    def first(self, share: float) -> Valid:
        return self.recording.within(share)

    def variance(self) -> Scalar | None:
        return self.system.sensor.variance()

    def is_classical(self) -> bool:
        return self.variance() is not None and isinstance(self.loss, Squares)

    def shifted(self, rows: Residuals) -> "Problem":
        return dataclasses.replace(self, recording=self.recording.shifted(rows))

    def misfit(self, residuals: Residuals) -> Scalar:
        return misfit(self.recording, residuals)

    def padded(self) -> "Problem":
        recording = self.recording.padded(_size(self.valid.shape[-1]))
        return dataclasses.replace(self, recording=recording)

    @property
    def log_units(self) -> Scalar:
        return jnp.zeros(())

    @property
    def sizes_found(self) -> int:
        return int(self.variance() is None)

    def system_with(self, values: Vector) -> System:
        """The system with parameters in their natural units, and those that are tied to them."""
        system = replaced(self.system, self.names, [values[..., i] for i in range(len(self.names))])
        if not self.ties:
            return system
        tied = [name for name, _ in self.ties]
        at = {
            name: handle.get(system) for name, handle in handles(system).items() if name not in tied
        }
        return replaced(system, tied, [tie(at) for _, tie in self.ties])

    def simulated(self, system: System, logged: Flag | None = None) -> Answer:
        """Residuals of a simulated system, without their Jacobian."""
        return Answer(*self.recording.residuals(system, self.simulation, logged))

    def starting_values(self) -> list[Scalar]:
        return [handle.get(self.system) for handle in self.handles().values()]

    def residuals(self, values: Vector) -> Residuals:
        return self.simulated(self.system_with(values)).residuals

    def answer(self, values: Vector, logged: Flag | None = None) -> Answer:
        def residuals(values: Vector) -> tuple[Residuals, Answer]:
            answer = self.simulated(self.system_with(values), logged)
            return answer.residuals, answer

        jacobian, answer = jax.jacfwd(residuals, has_aux=True)(values)
        return answer._replace(jacobian=jacobian)


def _size(count: int) -> int:
    """The next of the numbers 8, 12, 16, 24, 32, ... and so on."""
    power = 8 << max(math.ceil(math.log2(count / 8)), 0)
    return power * 3 // 4 if count <= power * 3 // 4 and power > 8 else power
