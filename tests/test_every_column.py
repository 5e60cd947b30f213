"""Derivatives of the state and of every column of the impact log, for every law."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from reference import richardson

COLUMNS = (
    "time",
    "approach_speed",
    "separation_speed",
    "restitution",
    "duration",
    "deepest_penetration",
    "peak_force",
    "energy_lost",
)
# A law from its parameters, and their values. Exponents are the user's to choose, not to fit, where
# the force is not analytic at touch.
LAWS = {
    "Restitution": (ij.Restitution, (0.6,)),
    "LinearRestitution": (ij.LinearRestitution, (0.7, 0.2)),
    "PowerRestitution": (ij.PowerRestitution, (0.6, 0.1)),
    "KelvinVoigt": (ij.KelvinVoigt, (727.5, 0.18)),
    "KelvinVoigt without pull": (
        lambda omega0, gamma: ij.KelvinVoigt(omega0, gamma, separation=ij.AtZeroForce()),
        (727.5, 0.18),
    ),
    "KelvinVoigtLinearRestitution": (ij.KelvinVoigtLinearRestitution, (727.5, 0.7, 0.2)),
    "Maxwell": (ij.Maxwell, (700.0, 0.2)),
    "Walton": (ij.Walton, (1e4, 2e3)),
    "Hertz": (ij.Hertz, (1e6,)),
    "Simon": (ij.Simon, (1e6, 0.3)),
    "HuntCrossley": (lambda k, c: ij.HuntCrossley(k, c, 1.4), (1e6, 0.3)),
    "PustPeterka": (lambda k, alpha: ij.PustPeterka(k, alpha, 2.0), (1e6, 0.3)),
    "HertzDashpot": (ij.HertzDashpot, (1e6, 2.0)),
    "PowerLaw": (ij.PowerLaw, (1e6, 2e4, 1.5, 1.0, 1.2)),
}
IMPACTS = 5


def outputs(name, tolerance, parameters):
    """State and impact log of a pendulum by the law's parameters, ω_n, ζ, length and its start."""
    make, values = LAWS[name]
    law = make(*parameters[: len(values)])
    omega_n, zeta, length, angle, rate = parameters[len(values) :]
    pendulum = ij.Pendulum(omega_n, zeta, length=length, mass=0.02)
    run = ij.simulate(
        ij.ImpactOscillator(pendulum, ij.Stop(law)),
        ij.InitialState(angle, rate),
        jnp.array([0.2, 0.5, 0.7]),
        t0=0.0,
        tolerance=tolerance,
        max_steps=320,
        max_impacts=IMPACTS,
    )
    log = {column: getattr(run.impacts, column) for column in COLUMNS}
    return {"position": run.position, "velocity": run.velocity, **log}


def start(name):
    return jnp.array([*LAWS[name][1], 13.47, 0.0017, 0.071, 0.7, 0.1])


@functools.cache
def forward(name):
    return jax.jit(jax.jacfwd(functools.partial(outputs, name, 1e-12)))(start(name))


def sizes(name):
    return np.maximum(np.abs(start(name)), 0.1)


@pytest.mark.parametrize("name", LAWS)
def test_forward_and_reverse_agree_in_every_column(name):
    reverse = jax.jit(jax.jacrev(functools.partial(outputs, name, 1e-12)))(start(name))
    for column, ahead in forward(name).items():
        scaled, difference = ahead * sizes(name), (ahead - reverse[column]) * sizes(name)
        assert np.all(np.isfinite(scaled)), column
        assert np.max(np.abs(difference)) <= 1e-12 * np.max(np.abs(scaled)), column


@pytest.mark.parametrize("name", LAWS)
def test_every_column_matches_richardson(name):
    values = jax.jit(functools.partial(outputs, name, 1e-13))
    parameters, exact = start(name), forward(name)
    assert np.all(np.asarray(values(parameters)["time"]) > 0)
    for i, size in enumerate(sizes(name)):

        def along(x, i=i):
            found = values(parameters.at[i].set(x))
            return np.concatenate([np.ravel(found[column]) for column in exact])

        estimate = richardson(along, float(parameters[i]), 1e-3 * size)
        begin = 0
        for column, slopes in exact.items():
            mine = np.ravel(slopes[..., i])
            theirs = estimate[begin : begin + mine.size]
            begin += mine.size
            largest = np.max(np.abs(slopes * sizes(name)))
            assert np.max(np.abs(mine - theirs)) * size <= 1e-8 * largest, (column, i)
