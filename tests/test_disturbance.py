"""Derivatives of motions that hardly show how fast a disturbance moves, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import impactjax as ij
from impactjax._simulate.disturbance import _rates, _rates_of_two
from tiers import quick, thorough

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


def resting(p, times):
    """Penetration of a mass in a stop that shakes, long after it came to stand there."""
    omega0, gamma, amplitude, frequency = p
    stiff, slow = omega0**2 - frequency**2, 2 * gamma * omega0 * frequency
    phase = frequency * times - jnp.arctan2(slow, stiff)
    return -9.81 / omega0**2 + amplitude * frequency**2 * jnp.sin(phase) / jnp.hypot(stiff, slow)


@thorough
@pytest.mark.parametrize("gamma", [0.03, 0.3, 1.0, 1.5])
def test_derivatives_of_mass_resting_in_shaken_stop(gamma):
    """The fast motion of the contact has faded: few steps are enough, also for all derivatives."""
    p, times = jnp.array([700.0, gamma, 1e-3, 60.0]), jnp.linspace(1.5, 2.0, 7)

    def run(p):
        ball = ij.BouncingBall(9.81, base=ij.HarmonicMotion(p[2], p[3]))
        model = ij.ImpactOscillator(ball, ij.Stop(ij.KelvinVoigt(p[0], p[1])))
        return ij.simulate(model, ij.InitialState(0.0, -0.01), times, t0=0.0, max_steps=2048)

    def positions(p):
        found = run(p)
        return found.position, (found.result, found.stats.steps)

    slopes, (result, steps) = jax.jit(jax.jacfwd(positions, has_aux=True))(p)
    assert result == ij.RESULTS.successful
    assert steps < {0.03: 1400, 0.3: 600, 1.0: 600, 1.5: 1200}[gamma]
    expected = jax.jacfwd(resting)(p, times)
    scale = np.max(np.abs(expected), axis=0)
    np.testing.assert_allclose(slopes / scale, expected / scale, atol=1e-7)


@quick
@pytest.mark.parametrize("seed", range(8))
def test_rates_of_two_states_are_those_of_eigenvalues(seed):
    """By NumPy; where a disturbance grows, also by the method for any number of states, which is
    right to a few per cent.
    """
    matrix = np.random.default_rng(seed).normal(size=(2, 2))
    values = np.linalg.eigvals(matrix)
    fades = np.max(values.real) < 0
    damping = -values[0].real / np.abs(values[0]) if fades and values[0].imag != 0 else 1.0
    for time in (0.0, 0.7, 3.0):
        grown = np.abs(np.exp(values * time))
        lasting = np.max(np.abs(values) * grown) / max(np.max(grown), 1.0)
        found = _rates_of_two(jnp.asarray(matrix), jnp.asarray(time))
        np.testing.assert_allclose(found, (np.max(np.abs(values)), lasting, damping), rtol=1e-12)
        if not fades:
            several = _rates(jnp.asarray(matrix), jnp.asarray(time))
            np.testing.assert_allclose(several[:2], found[:2], rtol=0.05)
