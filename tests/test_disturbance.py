"""Derivatives of motions that hardly show how fast a disturbance moves, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import impactjax as ij
from impactjax._simulate.disturbance import _rates, _rates_of_two
from tiers import quick

TIMES = np.linspace(0.0, 5.0, 11)


def derivative(model, x, v=0.0, times=TIMES):
    """Derivative of the positions by the initial position."""

    def positions(x):
        run = ij.simulate(model, ij.InitialState(x, v), times, t0=0.0, max_steps=4096)
        return run.position, run.result

    slopes, result = jax.jit(jax.jacfwd(positions, has_aux=True))(x)
    assert result == ij.RESULTS.successful
    return slopes


def swing(omega, zeta, times):
    """A damped oscillator let go at 1."""
    damped = omega * np.sqrt(1 - zeta**2)
    turn = np.cos(damped * times) + zeta * omega / damped * np.sin(damped * times)
    return np.exp(-zeta * omega * times) * turn


@pytest.mark.parametrize("start", [0.0, 1e-14, 0.1])
def test_derivative_of_oscillator_at_equilibrium(start):
    model = ij.ImpactOscillator(ij.LinearOscillator(10.0, 0.01), ij.Stop(ij.Restitution(0.5), 1.0))
    np.testing.assert_allclose(derivative(model, start), swing(10.0, 0.01, TIMES), atol=1e-7)


def test_derivative_of_mass_at_equilibrium_in_stop():
    law = ij.KelvinVoigt(100.0, 0.05)
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(law))
    slopes = derivative(model, -9.81 / 100.0**2)
    np.testing.assert_allclose(slopes, swing(100.0, 0.05, TIMES), atol=1e-7)


def test_derivative_of_mass_creeping_in_stop():
    g, omega0, gamma, times = 9.81, 100.0, 0.3, TIMES / 5
    model = ij.ImpactOscillator(ij.BouncingBall(g), ij.Stop(ij.Maxwell(omega0, gamma)))
    creep = 2 * gamma * omega0  # of the dashpot [1/s]
    rates = np.array(
        [[0.0, 1.0, 0.0], [-(omega0**2), 0.0, -(omega0**2)], [-creep, 0.0, -creep]]
    )  # of position, velocity and stroke
    slopes = derivative(model, -g / omega0**2, -creep * g / omega0**2, times)
    expected = [expm(rates * t)[0, 0] for t in times]
    np.testing.assert_allclose(slopes, expected, atol=1e-7)


def test_derivative_by_zero_base_amplitude():
    frequency = 40.0

    def positions(amplitude):
        ball = ij.BouncingBall(9.81, base=ij.HarmonicMotion(amplitude, frequency))
        model = ij.ImpactOscillator(ball, ij.Stop(ij.Restitution(0.5)))
        return ij.simulate(model, ij.InitialState(200.0), TIMES, t0=0.0).position

    slopes = jax.jit(jax.jacfwd(positions))(0.0)
    np.testing.assert_allclose(slopes, frequency * TIMES - np.sin(frequency * TIMES), atol=1e-6)


@quick
@pytest.mark.parametrize("seed", range(8))
def test_rates_of_two_states_are_those_of_eigenvalues(seed):
    """By NumPy, and by the method for any number of states, which is right to a few per cent."""
    matrix = np.random.default_rng(seed).normal(size=(2, 2))
    values = np.linalg.eigvals(matrix)
    for time in (0.0, 0.7, 3.0):
        grown = np.abs(np.exp(values * time))
        expected = np.max(np.abs(values)), np.max(np.abs(values) * grown) / np.max(grown)
        found = _rates_of_two(jnp.asarray(matrix), jnp.asarray(time))
        np.testing.assert_allclose(found, expected, rtol=1e-12)
        np.testing.assert_allclose(_rates(jnp.asarray(matrix), jnp.asarray(time)), found, rtol=0.05)
