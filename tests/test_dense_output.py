"""States within a Runge-Kutta step: as accurate as its end, with derivatives."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate

import impactjax as ij
from impactjax._simulate.automaton import NO_EVENT, Automaton
from impactjax._simulate.state import Phase, State, mode
from tiers import mostly_thorough

OMEGA_N, K = 13.0, 1e5
SOLVERS = {"Bosh3": (diffrax.Bosh3(), 0.2), "Dopri8": (diffrax.Dopri8(), 1.0)}  # and a step
SHARES = jnp.linspace(0.0, 1.0, 41)
FREE = mode(Phase.FLIGHT, 0, jnp.int32(0))
TOUCHING = mode(Phase.CONTACT, 0, jnp.int32(0))


def states(solver, model, position, velocity, during, h):
    """Position and velocity at shares of a step of duration `h`, with those of its end last."""
    step = ij.RungeKutta(solver)
    automaton = Automaton(jax.tree.map(jnp.asarray, model))
    zero = jnp.zeros(())
    y = State(jnp.asarray(position), jnp.asarray(velocity), ((),))
    row = automaton, zero, y, during, jnp.asarray(h), jnp.int32(NO_EVENT)
    expansion = step.expand(*row)
    end = step.end(automaton, during, expansion, jnp.asarray(h))
    inside = jax.vmap(lambda s: step.evaluate(automaton, during, expansion, s, zero))(SHARES * h)
    return jnp.stack(
        [jnp.append(inside.position, end.position), jnp.append(inside.velocity, end.velocity)]
    )


@pytest.mark.parametrize("name", mostly_thorough(SOLVERS, "Dopri8"))
def test_free_vibration_within_a_step(name):
    """And its derivatives by the start of the step: a matrix of sines and cosines."""
    solver, length = SOLVERS[name]
    h = length / OMEGA_N
    oscillator = ij.LinearOscillator(OMEGA_N)
    model = ij.ImpactOscillator(oscillator, ij.Stop(ij.Hertz(K), gap=9.0))
    phase = OMEGA_N * h * np.append(SHARES, 1.0)
    matrix = np.array([[np.cos(phase), np.sin(phase)], [-np.sin(phase), np.cos(phase)]])
    scale = np.array([1.0, OMEGA_N])  # of position and velocity

    def scaled(start):
        return states(solver, model, start[0], start[1] * OMEGA_N, FREE, h) / scale[:, None]

    start = jnp.array([1.0, 0.3])
    values, slopes = scaled(start), jax.jacfwd(scaled)(start)
    errors = np.abs(values - np.einsum("ijs,j->is", matrix, start))
    assert np.all(errors[:, 0] == 0)
    assert 1e-12 < np.max(errors[:, -1]) < 1e-3
    assert np.max(errors) < 1.2 * np.max(errors[:, -1])
    errors = np.abs(slopes - np.swapaxes(matrix, 1, 2))
    assert np.max(errors) < 1.2 * np.max(errors[:, -1])
    np.testing.assert_array_equal(slopes[:, 0], np.eye(2))


@pytest.mark.parametrize("name", mostly_thorough(SOLVERS, "Dopri8"))
def test_contact_within_a_step_that_begins_at_the_surface(name):
    """Motion of a mass against a spring of Hertz's, by SciPy."""
    solver, length = SOLVERS[name]
    model = ij.ImpactOscillator(ij.FreeMass(mass=1.0), ij.Stop(ij.Hertz(K)))
    start = np.array([0.0, -0.5])
    h = length / 2 * (-start[1] * K**2) ** -0.2  # 1.6 of these units from touch to turn
    times = h * np.append(SHARES, 1.0)
    exact = scipy.integrate.solve_ivp(
        lambda t, y: [y[1], K * max(-y[0], 0.0) ** 1.5],
        (0.0, h),
        start,
        method="DOP853",
        t_eval=times[:-1],
        rtol=1e-13,
        atol=1e-18,
    ).y
    found = states(solver, model, start[0], start[1], TOUCHING, h)
    scale = np.abs(exact[:, -1:])
    errors = np.abs(found - np.append(exact, exact[:, -1:], axis=1)) / scale
    assert 1e-11 < np.max(errors[:, -1]) < 1e-2
    assert np.max(errors) < 1.5 * np.max(errors[:, -1])
