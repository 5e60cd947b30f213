"""Derivatives of the state and of every column of the impact log, for every law."""

import dataclasses
import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._simulate.default_step import natural_step
from laws import ANALYTIC, AS_POWER_LAWS, RIGID, WITH_BROKEN_POWERS
from reference import richardson
from tiers import mostly_thorough

DISCRETE = ("count", "stop", "complete")
LOG = tuple(field.name for field in dataclasses.fields(ij.ImpactLog) if field.name not in DISCRETE)
EXTREMES = ("deepest_penetration", "peak_force")  # of each impact


class Case(NamedTuple):
    """A law from its parameters and what is not differentiated; cases of one law share programs."""

    make: Callable[..., ij.AbstractImpactLaw | ij.AbstractForceLaw]
    values: tuple[float, ...]
    exponents: tuple[float, ...] = ()


# Laws without a Taylor series as power laws (see test_laws.py), but for Hertz's, where c = 0.
CASES = {name: Case(*law) for name, law in {**RIGID, **ANALYTIC}.items()} | {
    name: Case(ij.PowerLaw, AS_POWER_LAWS[name][:2], AS_POWER_LAWS[name][2:])
    for name in WITH_BROKEN_POWERS
    if name != "hertz"
}
IMPACTS = 4
SERIES = ij.TaylorStep(order=8)  # compiles faster than the usual one


def outputs(make, parameters, exponents):
    """State and impact log of a pendulum by the law's parameters, ω_n, ζ, length and its start."""
    law = make(*parameters[:-5], *exponents)
    omega_n, zeta, length, angle, rate = parameters[-5:]
    pendulum = ij.Pendulum(omega_n, zeta, length=length, mass=0.02)
    model = ij.ImpactOscillator(pendulum, ij.Stop(law))
    analytic = isinstance(natural_step(model, 1e-8), ij.TaylorStep)
    run = ij.simulate(
        model,
        ij.InitialState(angle, rate),
        jnp.array([0.2, 0.5, 0.95]),
        t0=0.0,
        step=SERIES if analytic else ij.RungeKutta(),
        tolerance=1e-12 if analytic else 4e-15,
        max_steps=2048,
        max_impacts=IMPACTS,
    )
    log = {column: getattr(run.impacts, column) for column in LOG}
    extremes = {column: getattr(run, column) for column in EXTREMES}
    return {"position": run.position, "velocity": run.velocity, **log, **extremes}


@functools.cache
def programs(make):
    """Values, forward derivatives, and the gradient of a weighted sum of all columns."""

    def total(parameters, exponents, weights):
        found = outputs(make, parameters, exponents)
        return sum(jnp.sum(weight * found[column]) for column, weight in weights.items())

    values = functools.partial(outputs, make)
    return jax.jit(values), jax.jit(jax.jacfwd(values)), jax.jit(jax.grad(total))


def start(name):
    return jnp.array([*CASES[name].values, 13.47, 0.0017, 0.071, 0.7, 0.1])


def exponents(name):
    return jnp.array(CASES[name].exponents)


@functools.cache
def forward(name):
    return programs(CASES[name].make)[1](start(name), exponents(name))


def sizes(name):
    return np.maximum(np.abs(start(name)), 0.1)


def largest(name, column):
    """Logarithmic sensitivity: what differences in a column count against."""
    return np.max(np.abs(forward(name)[column] * sizes(name)))


@pytest.mark.parametrize("name", mostly_thorough(CASES, "kelvin-voigt"))
def test_impact_log_forward_and_reverse_derivatives_agree(name):
    """The derivative of a random sum of all columns, each in units of its largest sensitivity."""
    rng = np.random.default_rng(5)
    weights = {}
    for column, slopes in forward(name).items():
        assert np.all(np.isfinite(slopes)), column
        weights[column] = rng.normal(size=slopes.shape[:-1]) / (largest(name, column) or 1.0)

    gradient = programs(CASES[name].make)[2]
    reverse = gradient(start(name), exponents(name), weights) * sizes(name)
    ahead = sizes(name) * sum(
        np.tensordot(weight, forward(name)[column], axes=weight.ndim)
        for column, weight in weights.items()
    )
    np.testing.assert_allclose(reverse, ahead, rtol=0, atol=1e-12 * np.max(np.abs(ahead)))


@pytest.mark.parametrize("name", mostly_thorough(CASES, "kelvin-voigt"))
def test_impact_log_derivatives_match_richardson(name):
    values = programs(CASES[name].make)[0]
    parameters, exact = start(name), forward(name)
    assert np.all(np.asarray(values(parameters, exponents(name))["time"]) > 0)
    for i, size in enumerate(sizes(name)):

        def along(x, i=i):
            found = values(parameters.at[i].set(x), exponents(name))
            return np.concatenate([np.ravel(found[column]) for column in exact])

        estimate = richardson(along, float(parameters[i]), 5e-3 * size)
        begin = 0
        for column, slopes in exact.items():
            mine = np.ravel(slopes[..., i])
            theirs = estimate[begin : begin + mine.size]
            begin += mine.size
            error = np.max(np.abs(mine - theirs)) * size
            assert error <= 1e-8 * largest(name, column), (column, i)
