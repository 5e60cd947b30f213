"""Residuals of a system against a recording, as a function of named parameters."""

import dataclasses
from collections.abc import Callable, Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Bool, Float

from impactjax._known import AnyArray, namespace, placed
from impactjax._optimise.minimiser import Vector
from impactjax._parameter import plain
from impactjax._problem.abstract_problem import Answer, Number
from impactjax._problem.loss import AbstractLoss, Squares
from impactjax._problem.misfit import exceeds_noise, misfit
from impactjax._problem.noise import AbstractNoise, AutoregressiveNoise
from impactjax._problem.padding import padded_size
from impactjax._problem.parameters import Handle, handles, replaced
from impactjax._problem.prior import Normal
from impactjax._problem.scatter import AbstractScatter, NoScatter
from impactjax._problem.single_problem import AbstractSingleProblem
from impactjax._record.abstract_recording import AbstractRecording, Residuals, Valid
from impactjax._sensor.system import System
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulation import Simulation
from impactjax._types import Factors, Flag, Scalar

Tie = Callable[[Mapping[str, Scalar]], ArrayLike]


class Problem(AbstractSingleProblem[System]):
    """The least-squares problem of one recording.

    - `system`, `recording`: compared with each other.
    - `names`: names of the fitted parameters.
    - `simulation`, `loss`, `noise`: as in `Experiment`.
    - `ties`: parameters that follow from the others, by name.
    - `scatter`: distribution of the speed after each impact.
    - `bounds`: limits of parameters, narrower than their own range, by name.
    - `priors`: prior knowledge of parameters, by name. It is no part of the residuals.
    - `weight`: variance of a residual against which priors are weighed, if a fit has found it.
    - `direction`: direction in which the logarithms of the factors after the impacts change, one
      number for each impact; `None` if the answer has no derivative along it.
    """

    system: System
    recording: AbstractRecording
    names: tuple[str, ...] = eqx.field(static=True)
    simulation: Simulation = Simulation()
    loss: AbstractLoss = Squares()
    noise: AbstractNoise = AutoregressiveNoise()
    ties: tuple[tuple[str, Tie], ...] = eqx.field(static=True, default=())
    bounds: tuple[tuple[str, tuple[float, float]], ...] = eqx.field(static=True, default=())
    scatter: AbstractScatter = NoScatter()
    priors: dict[str, Normal] = eqx.field(default_factory=dict)
    weight: Float[AnyArray, "..."] | None = None
    direction: Factors | None = None

    def __check_init__(self) -> None:
        if not self.names:
            raise ValueError("No parameter is left to fit; all are fixed.")

    def each_recording(self) -> "list[tuple[Problem, tuple[int, ...]]]":
        return [(self, tuple(range(len(self.names))))]

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

    def variance(self) -> Number | None:
        return self.system.sensor.variance()

    def shifted(self, rows: Residuals) -> "Problem":
        return dataclasses.replace(self, recording=self.recording.shifted(rows))

    def misfit(self, residuals: Residuals) -> Number:
        return misfit(self.recording.variation(), residuals)

    def exceeds_noise(self, residuals: Residuals, impacts: ImpactLog) -> Bool[AnyArray, ""]:
        at_impacts = self.recording.at_impacts(impacts, self.system.sensor.delay)
        return exceeds_noise(residuals, plain(self.valid), at_impacts, self.variance())

    def padded(self) -> "Problem":
        recording = self.recording.padded(padded_size(self.valid.shape[-1]))
        # Scatter does not change what is simulated: fits with and without it share their programs.
        longer = dataclasses.replace(self, recording=recording, scatter=NoScatter())
        none = np.zeros(longer.impacts, jnp.result_type(float, *self.starting_values()))
        return longer.scattered(none) if self.has_stop else longer

    @property
    def has_stop(self) -> bool:
        """True if the model has a stop."""
        return self.system.model.lower is not None or self.system.model.upper is not None

    @property
    def impacts(self) -> int:
        """Number of impacts that may have a factor."""
        if self.recording.observes_impacts:
            return self.valid.shape[-1] - 1
        return self.simulation.max_impacts

    def all_have_factors(self, impacts: AnyArray) -> Bool[AnyArray, ""]:
        """True if a number of impacts is less than that of the factors, so that none lacks one."""
        if self.recording.observes_impacts:  # an impact after the last time has no effect
            return namespace(impacts).ones((), bool)
        return impacts < self.impacts

    def scattered(
        self,
        logarithms: Float[AnyArray, " first"],
        direction: Float[AnyArray, " impacts"] | None = None,
    ) -> "Problem":
        """The problem with a factor on the speed after each impact, given by its logarithm; the
        factor of later impacts is 1. Its answer has the derivative of the residuals along a
        direction of the logarithms.
        """
        xp = namespace(logarithms)
        logarithms = xp.pad(logarithms, (0, self.impacts - logarithms.shape[0]))
        direction = xp.zeros_like(logarithms) if direction is None else direction
        factors, direction = placed((xp.exp(logarithms), direction))
        system = dataclasses.replace(self.system, factors=factors)
        return dataclasses.replace(self, system=system, direction=direction)

    @property
    def log_units(self) -> Number:
        return np.zeros(())

    def system_with(self, values: Vector) -> System:
        each = placed([values[..., i] for i in range(len(self.names))])
        system = replaced(self.system, self.names, each)
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
        factors, direction = self.system.factors, self.direction

        def residuals(values: Vector, along: Scalar) -> tuple[Residuals, Answer]:
            system = self.system_with(values)
            if factors is not None and direction is not None:
                changed = factors * jnp.exp(along * direction)
                system = dataclasses.replace(system, factors=changed)
            answer = self.simulated(system, logged)
            return answer.residuals, answer

        nowhere = jnp.zeros((), values.dtype)
        if direction is None:
            jacobian, answer = jax.jacfwd(residuals, has_aux=True)(values, nowhere)
            return answer._replace(jacobian=jacobian)
        derivatives = jax.jacfwd(residuals, argnums=(0, 1), has_aux=True)
        (jacobian, effect), answer = derivatives(values, nowhere)
        return answer._replace(jacobian=jacobian, effect=effect)
