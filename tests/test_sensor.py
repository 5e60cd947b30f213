"""Sensors and masks in a fit, against linear regression and closed forms."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import impactjax as ij
from estimates import SMALL, TS, line
from impactjax._record.clipping import clipped
from impactjax._report.words import sentences

LINE = ij.ImpactOscillator(ij.FreeMass())


def fit_line(values, valid=None, sensor=None, free=()):
    recording = ij.Recording(jnp.asarray(TS), jnp.asarray(values), ij.Displacement(), valid)
    return ij.fit(
        ij.Experiment(
            LINE, recording, ij.InitialState(0.0), sensor=sensor, free=free, simulation=SMALL
        )
    )


def regression(values, kept, sigma=None):
    """Level, slope, their errors and the rms of the residuals, over the samples that are kept."""
    design = np.stack([np.ones_like(TS), TS - TS[0]], axis=1)[kept]
    found, squares, *_ = np.linalg.lstsq(design, values[kept])
    variance = squares[0] / (kept.sum() - 2) if sigma is None else sigma**2
    errors = np.sqrt(np.diag(variance * np.linalg.inv(design.T @ design)))
    return found, errors, math.sqrt(squares[0] / kept.sum())


KEPT = np.arange(31) % 4 != 1


def test_masked_samples_are_ignored():
    values, _ = line()
    spoiled = np.where(KEPT, values, np.nan)
    found = fit_line(spoiled, jnp.asarray(KEPT))
    expected, errors, rms = regression(values, KEPT)
    np.testing.assert_allclose(found.values, expected, rtol=1e-8)
    np.testing.assert_allclose(found.standard_errors, errors, rtol=1e-8)
    np.testing.assert_allclose(found.rms, rms, rtol=1e-8)
    half = stats.t(KEPT.sum() - 2).ppf(0.975) * errors
    np.testing.assert_allclose(found.high - found.values, half, rtol=1e-8)
    likelihood = stats.norm.logpdf(np.asarray(found.residuals)[KEPT], scale=rms).sum()
    np.testing.assert_allclose(found.aic, 2 * 3 - 2 * likelihood, rtol=1e-9)
    np.testing.assert_allclose(found.bic, 3 * math.log(KEPT.sum()) - 2 * likelihood, rtol=1e-9)
    profile = ij.profiled(found)
    np.testing.assert_allclose(profile.high, found.high, rtol=1e-6)


def test_masks_may_differ_between_lanes():
    values, _ = line()
    masks = np.stack([KEPT, ~KEPT, np.ones(31, bool)])
    many = jax.jit(jax.vmap(lambda valid: fit_line(values, valid)))(jnp.asarray(masks))
    for lane, mask in enumerate(masks):
        expected, errors, _ = regression(values, mask)
        np.testing.assert_allclose(many.values[lane], expected, rtol=1e-8)
        np.testing.assert_allclose(many.standard_errors[lane], errors, rtol=1e-8)


def test_too_few_valid_samples_are_refused():
    with pytest.raises(ValueError, match="has 2 observations, too few for 2"):
        fit_line(line()[0], jnp.arange(31) < 2)


def test_known_noise_gives_known_errors():
    values, _ = line()
    sigma, step = 0.04, 0.03
    size = math.sqrt(sigma**2 + step**2 / 12)
    found = fit_line(values, sensor=ij.Sensor(sigma=sigma, quantisation=step))
    _, errors, _ = regression(values, np.ones(31, bool), size)
    np.testing.assert_allclose(found.standard_errors, errors, rtol=1e-9)
    half = stats.norm.ppf(0.975) * errors
    np.testing.assert_allclose(found.high - found.values, half, rtol=1e-9)
    likelihood = stats.norm.logpdf(np.asarray(found.residuals), scale=size).sum()
    np.testing.assert_allclose(found.aic, 2 * 2 - 2 * likelihood, rtol=1e-9)
    profile = ij.profiled(found)
    np.testing.assert_allclose(profile.low, found.low, rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ij.Sensor(gain=0.0), "`gain` must not be zero"),
        (lambda: ij.Sensor(gain=math.nan), "`gain` must be finite"),
        (lambda: ij.Sensor(sigma=-1e-4), "`sigma` must be finite and greater than 0"),
        (lambda: ij.Sensor(sigma=0.0), "`sigma` must be"),
        (lambda: ij.Sensor(quantisation=math.nan), "`quantisation` must be"),
        (lambda: ij.Butterworth(0.0), "`cutoff` must be finite and greater than 0"),
        (
            lambda: ij.ImpulseResponse(np.array([]), 0.1),
            "`response` must be a list of at least two",
        ),
        (lambda: ij.ImpulseResponse(np.array([[1.0, 2.0]]), 0.1), "`response` must be a list"),
        (lambda: ij.ImpulseResponse(np.array([1.0, math.nan]), 0.1), "`response` must be finite"),
        (lambda: ij.ImpulseResponse(np.array([1.0, 0.0]), -0.1), "`interval` must be"),
        (lambda: ij.SoftL1(0.0), "`scale` must be"),
        (lambda: ij.StudentT(0.1, -1.0), "`freedom` must be"),
        (lambda: ij.Normal(math.nan, 1.0), "`mean` must be finite"),
        (lambda: ij.Normal(1.0, -1.0), "`sigma` must be"),
        (lambda: ij.LevenbergMarquardt(max_iterations=0), "`max_iterations` must be at least 1"),
    ],
)
def test_sensor_refuses_wrong_arguments(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize(("sigma", "said"), [(0.01, True), (0.05, False)])
def test_residual_beyond_noise_is_reported(sigma, said):
    found = fit_line(line()[0], sensor=ij.Sensor(sigma=sigma))
    sentences_said = " ".join(sentences([ij.Fitted("free flight", found, 0.0)]))
    assert ("times the stated noise of the sensor" in sentences_said) == said


@pytest.mark.parametrize(("step", "said"), [(0.02, True), (0.002, False)])
def test_residual_at_quantisation_level_is_reported(step, said):
    """A straight line, rounded; in the other case with noise of 0.05 m as well."""
    t = np.asarray(TS)
    values = np.round((0.3 + 0.7 * t) / step) * step + (0.0 if said else line()[0] - 0.3 - 0.7 * t)
    found = fit_line(values, sensor=ij.Sensor(quantisation=step))
    sentences_said = " ".join(sentences([ij.Fitted("free flight", found, 0.0)]))
    assert ("quantisation error" in sentences_said) == said


def test_offset_and_drift_are_fitted_if_free():
    """A swing about a wrong zero that moves."""
    ts = jnp.linspace(0.0, 2.0, 101)
    model = ij.ImpactOscillator(ij.LinearOscillator(6.0, 0.05))
    run = ij.simulate(model, ij.InitialState(0.3), ts)
    recording = ij.Recording(ts, 1.5 * run.position + 0.02 - 0.01 * ts, ij.Displacement())
    found = ij.fit(
        ij.Experiment(
            ij.ImpactOscillator(ij.LinearOscillator(5.8, 0.04)),
            recording,
            ij.InitialState(0.3),
            fixed=("x0", "x_dot0"),
            free=("gain", "offset", "drift"),
            simulation=SMALL,
        )
    )
    assert found.names == ("omega_n", "zeta", "gain", "offset", "drift")
    assert found.units == ("rad/s", "1", "1", "m", "m/s")
    np.testing.assert_allclose(found.values, [6.0, 0.05, 1.5, 0.02, -0.01], rtol=1e-6)


def test_missed_impacts_keep_their_number():
    r, speed, gravity = 0.8, 1.5, 9.80665
    times = 0.1 + 2 * speed / gravity * (1 - r ** np.arange(9)) / (1 - r)
    valid = np.arange(9) != 4
    wrong = np.where(valid, times, times + 0.01)
    found = ij.fit(
        ij.Experiment(
            ij.ImpactOscillator(ij.BouncingBall(), ij.Stop(ij.Restitution(0.75))),
            ij.ImpactTimes(jnp.asarray(wrong), jnp.asarray(valid)),
            ij.InitialState(0.0, 1.4),
            simulation=SMALL,
        )
    )
    np.testing.assert_allclose(found.value("r"), r, rtol=1e-7)
    np.testing.assert_allclose(found.value("x_dot0"), speed, rtol=1e-7)


def test_impulse_response_of_one_pole_is_the_butterworth_filter():
    cutoff = 20.0
    rate = 2 * math.pi * cutoff
    lags = np.arange(0, 0.15, 2e-4)
    measured = ij.ImpulseResponse(jnp.asarray(rate * np.exp(-rate * lags)), 2e-4)
    ts = jnp.asarray(np.sort(np.random.default_rng(1).uniform(0, 0.5, 400)))
    values, rates = jnp.sin(15 * ts), 15 * jnp.cos(15 * ts)
    known = ij.Butterworth(cutoff, order=1).filtered(ts, values, rates)
    np.testing.assert_allclose(measured.filtered(ts, values, rates), known, atol=2e-4)
    assert float(jnp.max(jnp.abs(known - values))) > 0.1


def test_impulse_response_of_a_delay():
    late = ij.ImpulseResponse(jnp.array([0.0, 0.0, 100.0, 0.0]), 0.01)
    ts = jnp.linspace(0.0, 1.0, 51)
    np.testing.assert_allclose(
        late.filtered(ts, 1 + ts**3, 3 * ts**2), 1 + jnp.maximum(ts - 0.02, 0) ** 3, atol=1e-12
    )


# Clipping.

WAVE = np.sin(np.linspace(0, 20, 2001))


@pytest.mark.parametrize("step", [1e-4, 1e-2])
@pytest.mark.parametrize("sign", [1, -1])
def test_clipped_top_is_detected(step, sign):
    values = np.round(np.minimum(WAVE, 0.8) / step) * step
    found = clipped(sign * values, None)
    assert np.mean(WAVE[found] > 0.79) > 0.99
    assert np.count_nonzero(found) > 0.95 * np.count_nonzero(WAVE > 0.81)


def test_clipped_beginning_is_detected():
    values = np.minimum(np.cos(np.linspace(0, 20, 2001)), 0.8)
    np.testing.assert_array_equal(clipped(values, None), values == 0.8)


@pytest.mark.parametrize("step", [1e-6, 1e-3, 1e-2, 5e-2, 0.2])
@pytest.mark.parametrize("noise", [0.0, 5e-3])
def test_quantisation_is_not_clipping(step, noise):
    noisy = WAVE + noise * np.random.default_rng(3).standard_normal(len(WAVE))
    assert not clipped(np.round(noisy / step) * step, None).any()


def test_stated_clipping_level_is_approximate():
    values = np.array([1.0, -156.7, 156.86, 154.0, 153.0])
    np.testing.assert_array_equal(clipped(values, 156.9), [False, True, True, True, False])
