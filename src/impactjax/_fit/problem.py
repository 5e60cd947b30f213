"""The residuals of a system against a recording."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from impactjax._fit.levenberg_marquardt import Quadratic, Vector
from impactjax._fit.loss import AbstractLoss, Squares
from impactjax._fit.noise import AbstractNoise, AutoregressiveNoise
from impactjax._fit.system import System, handles, replaced
from impactjax._fit.transform import to_range
from impactjax._measure.recording import AnyRecording, ImpactTimes, Recording
from impactjax._simulate.impact_log import ImpactLog
from impactjax._simulate.simulate import simulate
from impactjax._simulate.step import AbstractStep

Residuals = Float[Array, " observations"]


class Answer(NamedTuple):
    """What a simulation says about a recording."""

    residuals: Residuals  # simulated minus recorded, in the recording's SI unit; 0 if not valid
    impacts: ImpactLog
    jacobian: Float[Array, "observations parameters"] | None = None  # if it was asked for


class Simulation(eqx.Module):
    """How a fit simulates; see `simulate`."""

    tolerance: float = eqx.field(default=1e-8, static=True)
    max_steps: int = eqx.field(default=256, static=True)
    max_impacts: int = eqx.field(default=64, static=True)
    step: AbstractStep | None = None


class Problem(eqx.Module):
    """A recording, a system, which of its parameters are to be found, and what is assumed."""

    system: System
    recording: AnyRecording
    names: tuple[str, ...] = eqx.field(static=True)
    simulation: Simulation = Simulation()
    loss: AbstractLoss = Squares()
    noise: AbstractNoise = AutoregressiveNoise()

    def __check_init__(self) -> None:
        if not self.names:
            raise ValueError("No parameter is left to fit; all are fixed.")

    def answer(self, values: Vector) -> Answer:
        """Residuals with parameters in their natural units."""
        system = replaced(self.system, self.names, list(values))
        if isinstance(self.recording, ImpactTimes):
            return _of_impact_times(system, self.recording, self.simulation)
        return _of_samples(system, self.recording, self.simulation)

    def values(self, u: Vector) -> Vector:
        """Natural values from the optimiser's unbounded numbers."""
        known = handles(self.system)
        return jnp.stack([to_range(known[name].allowed, u[i]) for i, name in enumerate(self.names)])

    def expand(self, u: Vector) -> Quadratic[Answer]:
        """The cost around a point."""

        def residuals(values: Vector) -> tuple[Residuals, Answer]:
            answer = self.answer(values)
            return answer.residuals, answer

        values, slopes = jax.jvp(self.values, (u,), (jnp.ones_like(u),))
        jacobian, answer = jax.jacfwd(residuals, has_aux=True)(values)
        weighted = self.loss.weight(answer.residuals)[:, None] * jacobian
        gradient = weighted.T @ answer.residuals
        information = weighted.T @ jacobian
        return Quadratic(
            cost=jnp.sum(self.loss.cost(answer.residuals)),
            gradient=gradient * slopes,
            curvature=information * slopes[:, None] * slopes[None, :],
            information=information,
            answer=answer._replace(jacobian=jacobian),
        )


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
        (2 * times[-1] - times[0])[None],
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
