"""Properties of every system: drift, energy, units, time, tolerance, traces."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._series.order import natural_order
from tiers import mostly_thorough

IMPACTS = 1000


def test_lossless_ball_keeps_energy_over_thousand_impacts():
    height, g = 0.3, 9.80665
    model = ij.ImpactOscillator(ij.BouncingBall(g), ij.Stop(ij.Restitution(1.0)))
    flight = 2 * np.sqrt(2 * height / g)
    times = np.linspace(0.0, flight * (IMPACTS + 0.25), 50)
    run = ij.simulate(
        model,
        ij.InitialState(height),
        times,
        tolerance=1e-12,
        max_steps=2048,
        max_impacts=IMPACTS + 8,
    )
    energy = run.velocity**2 / 2 + g * run.position
    np.testing.assert_allclose(energy, g * height, rtol=1e-10)
    assert run.impacts.count == IMPACTS


def pendulum(parameters):
    """An undamped pendulum of unit mass on a Kelvin-Voigt stop, and the energy it began with."""
    omega_n, gamma, theta0 = parameters
    oscillator = ij.Pendulum(omega_n, length=0.1)
    model = ij.ImpactOscillator(oscillator, ij.Stop(ij.KelvinVoigt(700.0, gamma)))
    run = ij.simulate(
        model, ij.InitialState(theta0), TIMES, tolerance=1e-12, max_steps=256, max_impacts=8
    )
    return run, (omega_n * 0.1) ** 2 * (1 - jnp.cos(theta0))


TIMES = np.linspace(0.0, 1.0, 41)


def test_energy_is_lost_only_in_impacts():
    run, begin = jax.jit(pendulum)(jnp.array([13.0, 0.15, 0.6]))
    speed, angle = 0.1 * run.velocity[-1], run.position[-1]
    assert angle > 0
    energy = speed**2 / 2 + (13.0 * 0.1) ** 2 * (1 - jnp.cos(angle))
    np.testing.assert_allclose(begin - energy, jnp.sum(run.impacts.energy_lost), rtol=1e-10)


def shaken(parameters):
    """A forced linear oscillator; all that has a unit is a parameter."""
    omega_n, omega0, amplitude, frequency, phase, gap, start, t0 = parameters
    base = ij.HarmonicMotion(amplitude, frequency, phase)
    oscillator = ij.LinearOscillator(omega_n, 0.02, base=base)
    model = ij.ImpactOscillator(oscillator, ij.Stop(ij.KelvinVoigt(omega0, 0.2), gap))
    ts = t0 + jnp.linspace(0.0, 20.0, 11) / omega_n
    run = ij.simulate(
        model, ij.InitialState(start), ts, t0=t0, tolerance=1e-11, max_steps=512, max_impacts=64
    )
    since = jnp.where(run.impacts.happened, run.impacts.time - t0, 0.0)
    return run.position, since, run.peak_force, run.impacts.count


PLAIN = np.array([10.0, 400.0, 0.02, 14.0, 0.3, 0.01, 0.05, 0.0])
RUN = jax.jit(shaken)


def test_results_scale_with_units():
    """Lengths three times and times seven times as large."""
    length, time = 3.0, 7.0
    scale = np.array([1 / time, 1 / time, length, 1 / time, 1, length, length, time])
    x, t, force, count = RUN(PLAIN)
    scaled_x, scaled_t, scaled_force, scaled_count = RUN(PLAIN * scale)
    assert count == scaled_count
    np.testing.assert_allclose(scaled_x, length * x, atol=1e-10)
    np.testing.assert_allclose(scaled_t, time * t, rtol=1e-10)
    np.testing.assert_allclose(scaled_force, force * length / time**2, rtol=1e-8)


def test_results_are_invariant_under_time_shift():
    shift = 40.0
    moved = PLAIN + np.array([0, 0, 0, 0, -14.0 * shift, 0, 0, shift])
    x, t, _, count = RUN(PLAIN)
    moved_x, moved_t, _, moved_count = RUN(moved)
    assert count == moved_count
    np.testing.assert_allclose(moved_x, x, atol=1e-10)
    np.testing.assert_allclose(moved_t, t, atol=1e-10)


STEPS = [ij.TaylorStep(), ij.RungeKutta()]


@pytest.mark.parametrize("step", mostly_thorough(STEPS, STEPS[0]), ids=["taylor", "runge-kutta"])
def test_error_is_proportional_to_tolerance(step):
    """Slope of log error against log tolerance, from 1e-4 to 1e-11."""
    tolerances = 10.0 ** -np.arange(4, 12)
    model = ij.ImpactOscillator(ij.Pendulum(13.47, 0.002), ij.Stop(ij.Restitution(0.6)))

    @jax.jit
    def angles(tolerance):
        return ij.simulate(
            model,
            ij.InitialState(0.7),
            TIMES,
            step=step,
            tolerance=tolerance,
            max_steps=1024,
            max_impacts=16,
        ).position

    exact = angles(1e-13)
    errors = [float(jnp.max(jnp.abs(angles(tolerance) - exact))) for tolerance in tolerances]
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.8 < slope < 1.2
    assert np.all(np.array(errors) < 10 * tolerances)


def test_parameter_values_never_cause_a_retrace():
    traces = 0

    class Counted(ij.AbstractImpactLaw):
        r: jax.Array

        def restitution(self, speed):
            nonlocal traces
            traces += 1
            return self.r + 0 * speed

    seen = []
    for r, omega_n, start in ((0.5, 10.0, 0.3), (0.7, 12.0, -0.0), (0.2, 9.0, 0.1)):
        law = Counted(jnp.asarray(r))
        model = ij.ImpactOscillator(ij.LinearOscillator(omega_n), ij.Stop(law, 0.01))
        ij.simulate(model, ij.InitialState(start), TIMES[:3], max_steps=32, max_impacts=4)
        seen.append(traces)
    assert seen[0] > 0
    assert seen == seen[:1] * 3


def test_default_order_follows_tolerance():
    """Jorba and Zou (2005): 1 − ln(ε) / 2; a tolerance whose value is not known counts as small."""
    assert natural_order(np.exp(-19.9)) == 11
    assert natural_order(np.exp(-20.1)) == 12
    assert natural_order(np.array([1e-3, np.exp(-27.9)])) == 15
    assert natural_order(0.5) == natural_order(np.inf) == 4
    orders = []
    jax.jit(lambda tolerance: orders.append(natural_order(tolerance)))(1e-3)
    assert orders == [15]


@pytest.mark.parametrize("tolerance", [None, 1e-8])
def test_known_tolerance_and_times_stay_known_under_jit(tolerance):
    model, start = ij.ImpactOscillator(ij.Pendulum(13.0)), ij.InitialState(0.7)

    def steps(model, t0=0.0):
        return ij.simulate(model, start, np.array([0.1, 5.0]), t0=t0, tolerance=tolerance).stats

    assert jax.jit(steps)(model).steps == steps(model).steps
    with pytest.raises(ValueError, match="t0"):
        jax.jit(lambda model: steps(model, 0.2))(model)
