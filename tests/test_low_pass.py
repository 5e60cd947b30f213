"""The analogue Butterworth filter against SciPy's digital one on a fine grid, and closed forms."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal
from scipy.interpolate import CubicHermiteSpline

import impactjax as ij
from impactjax._sensor.filtered_samples import filtered_samples

CUTOFF = 50.0
ORDERS = [1, 2, 3, 4, 7, 12]
COUNT = 4001  # one number of samples, so that no operation compiles twice


def filtered(order, ts, values, rates):
    assert len(ts) == COUNT
    low_pass = ij.Butterworth(CUTOFF, order=order)
    return np.asarray(low_pass.filtered(jnp.asarray(ts), jnp.asarray(values), jnp.asarray(rates)))


def poles(order):
    """Poles of H = 1 / prod(1 - s / pole), on the left half of a circle of radius omega_c."""
    angles = math.pi * (2 * np.arange(order) + order + 1) / (2 * order)
    return 2 * math.pi * CUTOFF * np.exp(1j * angles)


@pytest.mark.parametrize("order", ORDERS)
def test_low_pass_agrees_with_scipy_on_fine_grid(order):
    """Samples at uneven times of a cubic in between, at rest before: sosfilt at 500 kHz."""
    generator = np.random.default_rng(order)
    ts = np.cumsum(generator.uniform(3e-5, 3e-4, COUNT))
    values = np.cumsum(generator.standard_normal(COUNT)) / 10
    rates = 300 * generator.standard_normal(COUNT)
    rates[0] = 0.0
    fine = np.arange(round(ts[0] * 5e5), round(ts[-1] * 5e5)) / 5e5
    spline = CubicHermiteSpline(ts, values, rates)(np.maximum(fine, ts[0]))
    sections = signal.butter(order, CUTOFF, fs=5e5, output="sos")
    expected, _ = signal.sosfilt(sections, spline, zi=signal.sosfilt_zi(sections) * values[0])
    at_samples = np.interp(ts[:-1], fine, expected)
    np.testing.assert_allclose(filtered(order, ts, values, rates)[:-1], at_samples, atol=1e-4)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("frequency", [5.0, 50.0, 120.0])
def test_low_pass_response_to_sine(order, frequency):
    ts = np.linspace(0.0, 0.8, COUNT)
    omega = 2 * math.pi * frequency
    found = filtered(order, ts, np.sin(omega * ts), omega * np.cos(omega * ts))
    gain = 1 / np.prod(1 - 1j * omega / poles(order))
    assert abs(gain) ** 2 == pytest.approx(1 / (1 + (frequency / CUTOFF) ** (2 * order)))
    expected = np.imag(gain * np.exp(1j * omega * ts))
    settled = ts > 0.6
    np.testing.assert_allclose(found[settled], expected[settled], atol=2e-6)


RISE = 1e-9
STEP_TIMES = np.concatenate([[0.0, RISE], np.linspace(1e-4, 0.1, COUNT - 2)])
STEP = (STEP_TIMES > 0).astype(float), np.zeros(COUNT)
AT = math.sqrt(2) * math.pi * CUTOFF * (STEP_TIMES[2:] - RISE / 2)


def test_low_pass_response_to_step():
    """1 - exp(-a t) (cos a t + sin a t) with a = omega_c / sqrt 2 for order two."""
    expected = 1 - np.exp(-AT) * (np.cos(AT) + np.sin(AT))
    np.testing.assert_allclose(filtered(2, STEP_TIMES, *STEP)[2:], expected, atol=1e-12)


def test_low_pass_derivative_by_cutoff():
    """2 a t exp(-a t) sin(a t) / cutoff."""

    @jax.jit
    def response(cutoff):
        values, rates = map(jnp.asarray, STEP)
        return ij.Butterworth(cutoff).filtered(jnp.asarray(STEP_TIMES), values, rates)

    _, found = jax.jvp(response, (CUTOFF,), (1.0,))
    np.testing.assert_allclose(found[2:], 2 * AT * np.exp(-AT) * np.sin(AT) / CUTOFF, atol=1e-10)


@pytest.mark.parametrize("order", ORDERS)
def test_low_pass_of_line_and_constant(order):
    ts = np.linspace(3.0, 3.2, COUNT)
    delay = -np.sum(np.real(1 / poles(order)))
    line = filtered(order, ts, 2 * ts, np.full(COUNT, 2.0))
    np.testing.assert_allclose(line, 2 * (ts - delay), rtol=1e-11)
    constant = filtered(order, ts, np.full(COUNT, 7.0), np.zeros(COUNT))
    np.testing.assert_allclose(constant, 7.0, rtol=1e-11)


def test_low_pass_of_dense_samples():
    """The same cubic on a grid a thousand times finer: its moments must not cancel."""
    coarse, dense = np.linspace(0.0, 4.0, COUNT), np.linspace(0.0, 4e-3, COUNT)
    few, many = (
        filtered(2, ts, np.maximum(ts - 1e-3, 0) ** 3, 3 * np.maximum(ts - 1e-3, 0) ** 2)
        for ts in (coarse, dense)
    )
    np.testing.assert_allclose(many[::1000], few[:5], rtol=1e-9, atol=1e-22)


@pytest.mark.parametrize("order", ORDERS)
def test_filter_of_samples_agrees_with_filter_of_motion(order):
    """The NumPy filter, which knows nothing of the motion beyond its ends, at a smooth swing."""
    ts = np.linspace(0.0, 1.6, COUNT)
    expected = filtered(order, ts, np.cos(12 * ts), -12 * np.sin(12 * ts))
    found = filtered_samples(ij.Butterworth(CUTOFF, order=order), np.cos(12 * ts), 2500.0)
    inside = (ts > 0.2) & (ts < 1.4)
    np.testing.assert_allclose(found[inside], expected[inside], atol=2e-3)


@pytest.mark.parametrize("order", [0, 13])
def test_wrong_filter_orders_are_refused(order):
    with pytest.raises(ValueError, match="`order` must be from 1 to 12"):
        ij.Butterworth(CUTOFF, order=order)


def test_sensor_is_gain_times_filter_plus_offset():
    ts = jnp.linspace(0.0, 0.1, COUNT)
    model = ij.ImpactOscillator(ij.FreeMass())
    run = ij.simulate(model, ij.InitialState(1.0, 2.0), ts)
    sensor = ij.Sensor(3.0, 0.5, 0.02, low_pass=ij.Butterworth(CUTOFF, order=1))
    late = 1 / (2 * math.pi * CUTOFF)
    expected = 3 * (1 + 2 * (np.asarray(ts) - late)) + 0.5
    np.testing.assert_allclose(sensor.shown(model, run, ij.Displacement()), expected, rtol=1e-12)
    at = sensor.sampled(ts, ij.Displacement())
    np.testing.assert_allclose(at, np.asarray(ts) - 0.02, rtol=1e-14)
