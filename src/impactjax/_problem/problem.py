"""What a fit minimises: the residuals of a system against a recording."""

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
from impactjax._problem.parameters import Handle, System, handles, replaced
from impactjax._record.recording import AnyRecording, ImpactTimes, Recording, Valid
from impactjax._simulate.chatter import Chatter
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulate import simulate, simulate_logged
from impactjax._simulate.step import AbstractStep
from impactjax._types import Flag, Scalar

Residuals = Float[Array, " observations"]
Own = TypeVar("Own")
Tie = Callable[[Mapping[str, Scalar]], ArrayLike]


class Answer(NamedTuple):
    """What a simulation says about a recording, or several about theirs."""

    residuals: Residuals  # simulated minus recorded, in the recording's SI unit; 0 if not valid
    impacts: ImpactLog  # zeros if it was not asked for
    jacobian: Float[Array, "observations parameters"] | None = None  # if it was asked for


class Simulation(eqx.Module):
    """How a fit simulates; see `simulate`."""

    tolerance: float | None = eqx.field(default=None, static=True)
    max_steps: int = eqx.field(default=512, static=True)
    max_impacts: int = eqx.field(default=64, static=True)
    step: AbstractStep | None = None


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
    def variance(self) -> Scalar | None:
        """Variance of a residual, if it is known."""

    @abc.abstractmethod
    def is_classical(self) -> bool:
        """Whether the errors are those of least squares under independent noise of known size."""

    @abc.abstractmethod
    def moved(self, rows: Residuals) -> "AbstractProblem":
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
    """

    system: System
    recording: AnyRecording
    names: tuple[str, ...] = eqx.field(static=True)
    simulation: Simulation = Simulation()
    loss: AbstractLoss = Squares()
    noise: AbstractNoise = AutoregressiveNoise()
    ties: tuple[tuple[str, Tie], ...] = eqx.field(static=True, default=())

    def __check_init__(self) -> None:
        if not self.names:
            raise ValueError("No parameter is left to fit; all are fixed.")

    def assumed(self) -> Assumed:
        return Assumed(self.loss, self.noise)

    def handles(self) -> dict[str, Handle]:
        known = handles(self.system)
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

    def moved(self, rows: Residuals) -> "Problem":
        if isinstance(self.recording, ImpactTimes):
            return eqx.tree_at(lambda each: each.recording.times, self, self.recording.times - rows)
        return eqx.tree_at(lambda each: each.recording.values, self, self.recording.values - rows)

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
        """What a simulation of a system says about the recording."""
        if isinstance(self.recording, ImpactTimes):
            return _of_impact_times(system, self.recording, self.simulation)
        return _of_samples(system, self.recording, self.simulation, logged)

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


def _of_samples(
    system: System, recording: Recording, simulation: Simulation, logged: Flag | None
) -> Answer:
    ts = system.sensor.sampled(recording.ts)
    trajectory = simulate_logged(
        system.model,
        system.initial,
        ts,
        t0=system.start.t0 - system.sensor.delay,
        step=simulation.step,
        tolerance=simulation.tolerance,
        max_steps=simulation.max_steps,
        max_impacts=simulation.max_impacts,
        chatter=Chatter(),
        logged=logged,
    )
    shown = system.sensor.shown(system.model, trajectory, recording.quantity)
    residuals = jnp.where(recording.valid, shown - recording.values, 0.0)
    return Answer(residuals, trajectory.impacts)


def _of_impact_times(system: System, recording: ImpactTimes, simulation: Simulation) -> Answer:
    """The run starts at the first impact; the others are those of its impact log."""
    times = recording.times
    count = times.shape[0]
    trajectory = simulate(
        system.model,
        system.initial,
        (2 * recording.last - times[0])[None],
        t0=system.start.t0,
        step=simulation.step,
        tolerance=simulation.tolerance,
        max_steps=simulation.max_steps,
        max_impacts=count - 1,
    )
    simulated = jnp.concatenate([system.start.t0[None], trajectory.impacts.time])
    happened = jnp.concatenate([jnp.ones(1, bool), trajectory.impacts.happened])
    late = jnp.where(happened, simulated + system.sensor.delay - times, jnp.nan)
    residuals = jnp.where(recording.valid, late, 0.0)
    return Answer(residuals, trajectory.impacts)
