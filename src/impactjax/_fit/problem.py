"""What a fit minimises: the residuals of a system against a recording."""

import abc
from collections.abc import Callable, Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from impactjax._fit.loss import AbstractLoss, Squares
from impactjax._fit.minimiser import Matrix, Quadratic, Vector
from impactjax._fit.noise import AbstractNoise, AutoregressiveNoise
from impactjax._fit.system import Handle, System, handles, replaced
from impactjax._fit.transform import to_range, to_unbounded
from impactjax._measure.recording import AnyRecording, ImpactTimes, Recording, Valid
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulate import simulate
from impactjax._simulate.step import AbstractStep
from impactjax._types import Scalar

Residuals = Float[Array, " observations"]
Tie = Callable[[Mapping[str, Scalar]], ArrayLike]


class Answer(NamedTuple):
    """What a simulation says about a recording, or several about theirs."""

    residuals: Residuals  # simulated minus recorded, in the recording's SI unit; 0 if not valid
    impacts: ImpactLog
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
        """What is assumed of the residuals."""

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
    def answer(self, values: Vector) -> Answer:
        """Residuals and their Jacobian with parameters in their natural units."""

    @abc.abstractmethod
    def variance(self) -> Scalar | None:
        """Variance of a residual, if it is known."""

    @abc.abstractmethod
    def is_classical(self) -> bool:
        """Whether the errors are those of least squares under independent noise of known size."""

    @abc.abstractmethod
    def moved(self, rows: Residuals) -> "AbstractProblem":
        """The problem with so much taken from what was recorded: the residuals grow by it."""

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

    @eqx.filter_jit
    def parts(self, shares: tuple[float, ...]) -> Bool[Array, "parts observations"]:
        """Which residuals count in each first part of the time."""
        return jnp.stack([self.first(share) for share in shares])

    def values(self, u: Vector) -> Vector:
        """Natural values from the optimiser's unbounded numbers."""
        known = self.handles()
        return jnp.stack([to_range(known[name].allowed, u[i]) for i, name in enumerate(self.names)])

    @eqx.filter_jit
    def unbounded(self, values: Float[Array, "... parameters"]) -> Float[Array, "... parameters"]:
        """The optimiser's numbers that stand for natural values."""
        known = self.handles()
        each = [
            to_unbounded(known[name].allowed, values[..., i]) for i, name in enumerate(self.names)
        ]
        return jnp.stack(each, axis=-1)

    def around(self, u: Vector, answer: Answer, valid: Valid) -> Quadratic:
        """The cost of some of the residuals around a point, in the optimiser's coordinates."""
        _, slopes = jax.jvp(self.values, (u,), (jnp.ones_like(u),))
        assert answer.jacobian is not None
        some = answer._replace(
            residuals=jnp.where(valid, answer.residuals, 0.0),
            jacobian=jnp.where(valid[:, None], answer.jacobian, 0.0),
        )
        cost, gradient, curvature = around(self.assumed().loss, some)
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
        return self.recording.first(share).valid

    def variance(self) -> Scalar | None:
        return self.system.sensor.variance()

    def is_classical(self) -> bool:
        return self.variance() is not None and isinstance(self.loss, Squares)

    def moved(self, rows: Residuals) -> "Problem":
        if isinstance(self.recording, ImpactTimes):
            return eqx.tree_at(lambda each: each.recording.times, self, self.recording.times - rows)
        return eqx.tree_at(lambda each: each.recording.values, self, self.recording.values - rows)

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

    def simulated(self, system: System) -> Answer:
        """What a simulation of a system says about the recording."""
        if isinstance(self.recording, ImpactTimes):
            return _of_impact_times(system, self.recording, self.simulation)
        return _of_samples(system, self.recording, self.simulation)

    def answer(self, values: Vector) -> Answer:
        def residuals(values: Vector) -> tuple[Residuals, Answer]:
            answer = self.simulated(self.system_with(values))
            return answer.residuals, answer

        jacobian, answer = jax.jacfwd(residuals, has_aux=True)(values)
        return answer._replace(jacobian=jacobian)


def _of_samples(system: System, recording: Recording, simulation: Simulation) -> Answer:
    ts = system.sensor.sampled(recording.ts)
    trajectory = simulate(
        system.model,
        system.initial,
        ts,
        t0=system.start.t0 - system.sensor.delay,
        step=simulation.step,
        tolerance=simulation.tolerance,
        max_steps=simulation.max_steps,
        max_impacts=simulation.max_impacts,
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
