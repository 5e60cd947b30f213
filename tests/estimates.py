"""Small fits that several tests look at, each made once."""

import functools

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import impactjax as ij

SMALL = ij.Simulation(max_steps=32, max_impacts=8)
TS = np.linspace(0.5, 2.0, 31)
COUNT = 400
RESIDUAL_TS = np.linspace(0.0, 4.0, COUNT)


@functools.cache
def line() -> tuple[np.ndarray, ij.Estimate[ij.Problem]]:
    """A noisy straight line, fitted by a free mass."""
    values = 0.3 + 0.7 * TS + 0.05 * np.random.default_rng(1).standard_normal(31)
    recording = ij.Recording(jnp.asarray(TS), jnp.asarray(values), ij.Displacement())
    model = ij.ImpactOscillator(ij.FreeMass())
    return values, ij.fit(
        ij.Experiment(model, recording, ij.InitialState(0.0), simulation=SMALL), starts=ij.Starts(4)
    )


def with_dry_friction(estimate: ij.Estimate[ij.Problem]) -> ij.Estimate[ij.Problem]:
    """The estimate as if it were of free flight of an oscillator with dry friction."""
    oscillator = ij.LinearOscillator(5.0, dry_friction=0.1)
    model = ij.ImpactOscillator(oscillator)
    return eqx.tree_at(lambda e: e.problem.system.model, estimate, model)


@functools.cache
def swing() -> ij.Estimate[ij.Problem]:
    """A noisy undamped swing, fitted with damping and with a stop that it never reaches."""
    ts = np.linspace(0.0, 1.0, 41)
    values = np.cos(5 * ts) + 0.01 * np.random.default_rng(3).standard_normal(41)
    recording = ij.Recording(jnp.asarray(ts), jnp.asarray(values), ij.Displacement())
    model = ij.ImpactOscillator(
        ij.LinearOscillator(5.1, 0.01), ij.Stop(ij.Restitution(0.5), gap=2.0)
    )
    found = ij.fit(
        ij.Experiment(model, recording, ij.InitialState(0.9), fixed=("x_dot0",), simulation=SMALL),
        starts=ij.Starts(4),
    )
    return ij.profiled(found)


def leaving(left: np.ndarray, impacts: tuple[float, ...] = ()) -> ij.Estimate[ij.Problem]:
    """A fit that leaves given residuals, recorded minus fitted, with impacts at given times."""
    _, estimate = line()
    recording = ij.Recording(jnp.asarray(RESIDUAL_TS), jnp.asarray(left), ij.Displacement())
    slots = estimate.impacts.time.shape[0]
    times = jnp.zeros(slots).at[: len(impacts)].set(jnp.asarray(impacts, float))
    return eqx.tree_at(
        lambda e: (e.problem.recording, e.residuals, e.rms, e.impacts.time, e.impacts.count),
        estimate,
        (
            recording,
            jnp.asarray(-left),
            jnp.sqrt(jnp.mean(jnp.asarray(left) ** 2)),
            times,
            jnp.asarray(len(impacts), estimate.impacts.count.dtype),
        ),
    )
