"""Small and vanishing forces, own laws, and factors at a separation inside the indentation."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

import impactjax as ij
from systems import Own
from tiers import thorough


def _forced(t, position, velocity, omega, a, frequency):
    """−ω² x + a sin(Ω t)."""
    del velocity
    return -(omega**2) * position + a * jnp.sin(frequency * t)


class Dragged(Own):
    """x″ = law(t, x, x′) − x′ |x′|."""

    def resistance(self, speed):
        return speed**2


class Viscoelastic(ij.AbstractImpactLaw):
    """r = 1 − C v^(1/5)."""

    c: Array = eqx.field(converter=ij.as_parameter, metadata=ij.parameter("1", at_least=0))

    def restitution(self, speed):
        return 1 - self.c * speed**0.2


@pytest.mark.parametrize("step", [None, ij.RungeKutta()], ids=["Taylor", "Runge-Kutta"])
@pytest.mark.parametrize("a", [0.0, 1e-9])
def test_derivative_by_the_amplitude_of_an_own_force(a, step):
    omega, frequency, ts = 2.0, 60.0, np.array([1.0, 2.0])

    def position(a):
        model = ij.ImpactOscillator(Own(law=_forced, constants=(omega, a, frequency)))
        return ij.simulate(model, ij.InitialState(1.0), ts, t0=0.0, step=step).position

    exact = np.sin(frequency * ts) - frequency / omega * np.sin(omega * ts)
    exact /= omega**2 - frequency**2
    np.testing.assert_allclose(jax.jacfwd(position)(a), exact, atol=1e-9)


@thorough
def test_derivative_by_a_vanishing_base_amplitude_in_a_compliant_stop():
    omega0, gamma, frequency, phase, ts = 200.0, 0.6, 8.0, 0.3, np.array([2.5, 3.0])

    def position(amplitude):
        base = ij.HarmonicMotion(amplitude, frequency, phase)
        stop = ij.Stop(ij.KelvinVoigt(omega0, gamma))
        model = ij.ImpactOscillator(ij.BouncingBall(base=base), stop)
        return ij.simulate(model, ij.InitialState(0.02), ts, t0=0.0, max_steps=4096).position

    response = frequency**2 / (omega0**2 - frequency**2 + 2j * gamma * omega0 * frequency)
    exact = np.imag(response * np.exp(1j * (frequency * ts + phase)))
    np.testing.assert_allclose(jax.jacfwd(position)(0.0), exact, rtol=1e-6)


@thorough
def test_derivative_of_a_summed_chatter_by_a_vanishing_base_amplitude():
    """By perturbation of each flight, in 60 digits: −991.71822636."""

    def rest(amplitude):
        base = ij.HarmonicMotion(amplitude, 100.0, 0.3)
        model = ij.ImpactOscillator(ij.BouncingBall(9.81, base=base), ij.Stop(ij.Restitution(0.8)))
        ts, start = jnp.array([3.0]), ij.InitialState(0.2)
        return ij.simulate(model, start, ts, t0=0.0, max_impacts=200).rests.begin[0]

    np.testing.assert_allclose(jax.jacfwd(rest)(0.0), -991.71822636, rtol=1e-6)


@pytest.mark.parametrize("dry_friction", [0.0, 1e-12])
def test_a_mass_without_dry_friction_leaves_its_equilibrium(dry_friction):
    omega, zeta, amplitude, frequency, ts = 10.0, 0.01, 0.01, 7.0, np.linspace(0, 2, 5)
    base = ij.HarmonicMotion(amplitude, frequency)
    oscillator = ij.LinearOscillator(omega, zeta, dry_friction=dry_friction, base=base)
    run = ij.simulate(ij.ImpactOscillator(oscillator), ij.InitialState(0.0), ts)
    steady = amplitude * frequency**2
    steady /= omega**2 - frequency**2 + 2j * zeta * omega * frequency
    damped = omega * np.sqrt(1 - zeta**2)
    cosine = -np.imag(steady)
    sine = (-frequency * np.real(steady) + zeta * omega * cosine) / damped
    free = np.exp(-zeta * omega * ts) * (cosine * np.cos(damped * ts) + sine * np.sin(damped * ts))
    assert run.result == ij.RESULTS.successful
    np.testing.assert_allclose(
        run.position, np.imag(steady * np.exp(1j * frequency * ts)) + free, atol=1e-9
    )


def test_derivative_at_the_equilibrium_of_a_mass_without_dry_friction():
    omega, ts = 10.0, np.linspace(0, 2, 5)
    model = ij.ImpactOscillator(ij.LinearOscillator(omega, dry_friction=0.0))

    def position(x0):
        return ij.simulate(model, ij.InitialState(x0), ts).position

    np.testing.assert_allclose(jax.jacfwd(position)(0.0), np.cos(omega * ts), atol=1e-7)


def test_a_mass_with_drag_leaves_its_equilibrium():
    """For a small force the drag is negligible: x = a (sin(Ω t) − Ω/ω sin(ω t)) / (ω² − Ω²)."""
    omega, a, frequency, ts = 2.0, 1e-9, 3.0, np.linspace(0, 2, 5)
    model = ij.ImpactOscillator(Dragged(law=_forced, constants=(omega, a, frequency)))
    run = ij.simulate(model, ij.InitialState(0.0), ts)
    exact = a * (np.sin(frequency * ts) - frequency / omega * np.sin(omega * ts))
    assert run.result == ij.RESULTS.successful
    np.testing.assert_allclose(run.position, exact / (omega**2 - frequency**2), atol=1e-16)


@thorough
@pytest.mark.parametrize(
    "law", [ij.Maxwell(60.0, 0.15), ij.KelvinVoigt(600.0, 0.3, separation=ij.AtZeroForce())]
)
def test_factor_acts_where_the_mass_leaves_the_stop_and_not_before(law):
    """The contact ends inside the indentation: the log has the speed there, without the factor."""
    model = ij.ImpactOscillator(ij.BouncingBall(9.81), ij.Stop(law))

    def run(t, factor):
        ts, factors = jnp.array([t]), jnp.full(20, factor)
        start = ij.InitialState(0.012)
        return ij.simulate(model, start, ts, t0=0.0, factors=factors, max_steps=4096)

    log = run(0.4, 0.5).impacts
    end = float(log.time[0] + log.duration[0])
    np.testing.assert_allclose(log.separation_speed[0], run(end + 1e-9, 0.5).velocity[0], rtol=1e-6)
    np.testing.assert_allclose(log.separation_speed[0], run(0.4, 1.0).impacts.separation_speed[0])


@pytest.mark.parametrize("speeds", [[2.0, 1.0, 0.5], [-1.0, 1.0, 2.0]])
def test_speeds_out_of_order_are_refused_under_jit(speeds):
    @jax.jit
    def result(speeds):
        law = ij.LearnedRestitution(speeds, jnp.zeros(5))
        model = ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(law))
        return ij.simulate(model, ij.InitialState(0.2), jnp.array([0.6]), t0=0.0).result

    assert result(jnp.array(speeds)) == ij.RESULTS.impossible_parameters


@thorough
def test_reverse_derivative_of_an_own_law_with_an_infinite_slope_at_rest():
    """One bounce of a ball: x = r v τ − g τ²/2 with dr/dC = −v^(1/5)."""
    g, height, t = 9.81, 0.2, 0.4

    def position(c):
        model = ij.ImpactOscillator(ij.BouncingBall(g), ij.Stop(Viscoelastic(c)))
        return ij.simulate(model, ij.InitialState(height), jnp.array([t]), t0=0.0).position[0]

    speed, fall = np.sqrt(2 * g * height), np.sqrt(2 * height / g)
    exact = -(speed**0.2) * speed * (t - fall)
    np.testing.assert_allclose(jax.grad(position)(0.1), exact, rtol=1e-8)
