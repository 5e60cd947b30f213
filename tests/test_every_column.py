"""Derivatives of the state and of every column of the impact log, for every law."""

import functools

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._simulate.natural_step import natural_step
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
LEAST = {"restitution": 1e-2, "energy_lost": 1e-4}  # sensitivity that counts: Hertz loses nothing
IMPACTS = 4
STEP = ij.RungeKutta(diffrax.Tsit5())  # for laws without a Taylor series: compiles the fastest


def outputs(name, parameters):
    """State and impact log of a pendulum by the law's parameters, ω_n, ζ, length and its start."""
    make, values = LAWS[name]
    law = make(*parameters[: len(values)])
    omega_n, zeta, length, angle, rate = parameters[len(values) :]
    pendulum = ij.Pendulum(omega_n, zeta, length=length, mass=0.02)
    model = ij.ImpactOscillator(pendulum, ij.Stop(law))
    analytic = isinstance(natural_step(model), ij.TaylorStep)
    run = ij.simulate(
        model,
        ij.InitialState(angle, rate),
        jnp.array([0.2, 0.5, 0.95]),
        t0=0.0,
        step=None if analytic else STEP,
        tolerance=1e-12 if analytic else 1e-14,
        max_steps=96 if analytic else 8192,
        max_impacts=IMPACTS,
    )
    log = {column: getattr(run.impacts, column) for column in COLUMNS}
    return {"position": run.position, "velocity": run.velocity, **log}


def start(name):
    return jnp.array([*LAWS[name][1], 13.47, 0.0017, 0.071, 0.7, 0.1])


@functools.cache
def forward(name):
    return jax.jit(jax.jacfwd(functools.partial(outputs, name)))(start(name))


def sizes(name):
    return np.maximum(np.abs(start(name)), 0.1)


def largest(name, column):
    """Logarithmic sensitivity: what differences in a column count against."""
    return max(np.max(np.abs(forward(name)[column] * sizes(name))), LEAST.get(column, 0.0))


@pytest.mark.parametrize("name", LAWS)
def test_forward_and_reverse_agree_in_every_column(name):
    """The derivative of a random sum of all columns, each in units of its largest sensitivity."""
    rng = np.random.default_rng(5)
    weights = {}
    for column, slopes in forward(name).items():
        assert np.all(np.isfinite(slopes)), column
        weights[column] = rng.normal(size=slopes.shape[:-1]) / largest(name, column)

    def total(parameters):
        found = outputs(name, parameters)
        return sum(jnp.sum(weight * found[column]) for column, weight in weights.items())

    reverse = jax.jit(jax.grad(total))(start(name)) * sizes(name)
    ahead = sizes(name) * sum(
        np.tensordot(weight, forward(name)[column], axes=weight.ndim)
        for column, weight in weights.items()
    )
    np.testing.assert_allclose(reverse, ahead, rtol=0, atol=1e-12 * np.max(np.abs(ahead)))


@pytest.mark.parametrize("name", LAWS)
def test_every_column_matches_richardson(name):
    values = jax.jit(functools.partial(outputs, name))
    parameters, exact = start(name), forward(name)
    assert np.all(np.asarray(values(parameters)["time"]) > 0)
    for i, size in enumerate(sizes(name)):

        def along(x, i=i):
            found = values(parameters.at[i].set(x))
            return np.concatenate([np.ravel(found[column]) for column in exact])

        estimate = richardson(along, float(parameters[i]), 5e-3 * size)
        begin = 0
        for column, slopes in exact.items():
            mine = np.ravel(slopes[..., i])
            theirs = estimate[begin : begin + mine.size]
            begin += mine.size
            error = np.max(np.abs(mine - theirs)) * size
            assert error <= 1e-8 * largest(name, column), (column, i)
