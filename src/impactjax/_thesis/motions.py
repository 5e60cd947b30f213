"""Motions of the thesis's pendulum, many in one call."""

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

import impactjax as ij
from impactjax._thesis.constants import LENGTH, MASS, OMEGA_N, ZETA, Case

SAMPLES = 15_000  # of each motion: a record of 15 s at 1 kHz
PERIODS = 40  # of the base, in the window of `strobe`
REST = 0.02  # a contact that lasts longer is a rest on the stop; a rebound takes 5 ms [s]
_LANES = 24  # in one portion, which fits the processor's cache
_MAX_STEPS, _MAX_IMPACTS = 16_384, 8_192

Column: TypeAlias = np.ndarray | jax.Array


class Lane(NamedTuple):
    """A motion to simulate, from rest at a time zero.

    - `model`: pendulum and stop.
    - `angle`: angle at the start [rad].
    - `begin`, `every`: first sample and interval of the samples [s].
    """

    model: ij.ImpactOscillator
    angle: float
    begin: float
    every: float


def pendulum(amplitude: float = 0.0, omega: float = 1.0) -> ij.Pendulum:
    """The pendulum on a base that moves by A cos Ωt [m], [rad/s].

    The phase is a quarter period ahead of that of equation 2.10, as Figure 4.6 shows.
    """
    base = ij.HarmonicMotion(amplitude, omega, math.pi / 2)
    return ij.Pendulum(OMEGA_N, ZETA, length=LENGTH, mass=MASS, base=base)


def against(law: ij.AbstractImpactLaw | ij.AbstractForceLaw, *base: float) -> ij.ImpactOscillator:
    """The pendulum against a stop; `base` is its amplitude and frequency."""
    return ij.ImpactOscillator(pendulum(*base), ij.Stop(law))


def rigid(case: Case) -> ij.ImpactOscillator:
    """A forced motion of chapter 4, with restitution."""
    return against(ij.LinearRestitution(*case.rigid), case.amplitude, case.omega)


def soft(case: Case) -> ij.ImpactOscillator:
    """A forced motion of chapter 4, with a Kelvin-Voigt contact."""
    law = ij.KelvinVoigtLinearRestitution(*case.soft)
    return against(law, case.amplitude, case.omega)


def transient(
    law: ij.AbstractImpactLaw | ij.AbstractForceLaw, angle: float, seconds: float
) -> Lane:
    """A motion from rest on a base at rest, sampled from its beginning."""
    return Lane(against(law), angle, 0.0, seconds / SAMPLES)


def strobe(model: ij.ImpactOscillator, omega: float, skipped: int = 160) -> Lane:
    """A steady motion over `PERIODS` whole periods of the base, after some that are skipped."""
    period = 2 * math.pi / omega
    return Lane(model, 0.2, skipped * period, PERIODS * period / SAMPLES)


class Motion(NamedTuple):
    """A simulated motion, in NumPy arrays.

    - `ts`, `position`, `velocity`: samples [s], [rad], [rad/s].
    - `impacts`, `rests`: the logs, rows from their `count` on are zero.
    - `deepest_penetration`: of each impact [m].
    """

    ts: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    impacts: ij.ImpactLog
    rests: ij.RestLog
    deepest_penetration: np.ndarray

    def late(self, column: Column) -> np.ndarray:
        """The rows of a column of the impact log within the samples."""
        times = self.happened(self.impacts.time)
        return self.happened(column)[(times >= self.ts[0]) & (times < self.ts[-1])]

    def happened(self, column: Column) -> np.ndarray:
        """The rows of a column of the impact log that hold an impact."""
        return np.asarray(column)[: int(self.impacts.count)]

    def rest(self, column: Column) -> np.ndarray:
        """The rows of a column of the rest log that hold a rest."""
        return np.asarray(column)[: int(self.rests.count)]


def runs(lanes: Sequence[Lane]) -> list[Motion]:
    """The motions, all with the same kind of law.

    All portions have the same shape, so that a law is compiled once.

    **Raises** `RuntimeError` if a motion cannot be simulated.
    """
    found = []
    for first in range(0, len(lanes), _LANES):
        portion = lanes[first : first + _LANES]
        filled = [*portion, *[portion[-1]] * (_LANES - len(portion))]
        rows = jax.tree.map(lambda *leaves: jnp.stack([*map(jnp.asarray, leaves)]), *filled)
        motions, results = _swept(rows)
        for k in range(len(portion)):
            result = jax.tree.map(lambda leaf, k=k: leaf[k], results)
            if not bool(result == ij.RESULTS.successful):
                raise RuntimeError(f"A motion ended early: {ij.RESULTS[result]}")
            found.append(Motion(*jax.tree.map(lambda leaf, k=k: np.asarray(leaf[k]), motions)))
    return found


@eqx.filter_jit
def _swept(lanes: Lane) -> tuple[PyTree, ij.RESULTS]:
    return jax.vmap(_run)(lanes)


def _run(lane: Lane) -> tuple[PyTree, ij.RESULTS]:
    ts = lane.begin + lane.every * jnp.arange(SAMPLES)
    found = ij.simulate(
        lane.model,
        ij.InitialState(lane.angle),
        ts,
        t0=0.0,
        max_steps=_MAX_STEPS,
        max_impacts=_MAX_IMPACTS,
    )
    logs = found.impacts, found.rests, found.deepest_penetration
    return (ts, found.position, found.velocity, *logs), found.result


def period(motion: Motion) -> int:
    """Periods of the base after which a motion sampled by `strobe` repeats; 0 if it does not."""
    whole = motion.position.reshape(PERIODS, -1)
    for lag in range(1, PERIODS // 2 + 1):
        if np.abs(whole[lag:] - whole[:-lag]).max() < 1e-6 * np.ptp(whole):
            return lag
    return 0
