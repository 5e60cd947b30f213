"""The bootstrap against the errors of linear regression."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

import impactjax as ij
from tiers import mostly_thorough, thorough

TS = np.linspace(0.0, 2.0, 201)
LINE = ij.ImpactOscillator(ij.FreeMass(), ij.Stop(ij.Restitution(0.5), gap=9.0))  # never reached
QUICK = ij.Simulation(max_steps=16, max_impacts=2, step=ij.TaylorStep(order=4))


def fitted(errors: np.ndarray, sensor: ij.Sensor | None = None) -> ij.Estimate[ij.Problem]:
    recording = ij.Recording(
        jnp.asarray(TS), jnp.asarray(0.3 + 0.7 * TS + errors), ij.Displacement()
    )
    return ij.fit(
        ij.Experiment(
            LINE,
            recording,
            ij.InitialState(0.1, 0.5),
            sensor=sensor,
            fixed=("r",),
            simulation=QUICK,
        )
    )


def white(seed: int = 1) -> np.ndarray:
    return 0.05 * np.random.default_rng(seed).standard_normal(len(TS))


def autoregression(innovations: np.ndarray) -> np.ndarray:
    """e of eₜ = 0.8 eₜ₋₁ + innovation."""
    return np.asarray(signal.lfilter([1.0], [1.0, -0.8], innovations))


@pytest.mark.parametrize("sigma", mostly_thorough([None, 0.08], 0.08))
def test_bootstrap_of_white_noise_gives_regression_errors(sigma):
    estimate = fitted(white(), None if sigma is None else ij.Sensor(sigma=sigma))
    found = ij.bootstrap(estimate, 1000)
    assert bool(np.all(found.converged))
    np.testing.assert_allclose(found.standard_errors, estimate.standard_errors, rtol=0.08)
    little = 0.15 * float(jnp.max(estimate.standard_errors))
    np.testing.assert_allclose(found.low, estimate.low, atol=little)
    np.testing.assert_allclose(found.high, estimate.high, atol=little)
    assert np.all(np.abs(found.bias) < 0.15 * estimate.standard_errors)


@thorough
def test_bootstrap_noise_has_the_residuals_correlation():
    """An autoregression of 0.8 triples the errors."""
    estimate = fitted(autoregression(white()))
    found = ij.bootstrap(estimate, 1000)
    assert np.all(estimate.inflation > 2)
    np.testing.assert_allclose(found.standard_errors, estimate.standard_errors, rtol=0.15)


def test_bootstrap_noise_has_autoregressive_spectrum():
    """Autocovariances of the drawn noise: σ² 0.8ᵏ / (1 − 0.8²)."""
    scores = autoregression(np.random.default_rng(2).standard_normal(20000))
    keys = jax.random.split(jax.random.key(0), 200)
    noise = ij.AutoregressiveNoise(most=1)
    drawn = np.asarray(
        jax.vmap(lambda key: noise.drawn(key, jnp.asarray(scores), jnp.asarray(20000.0)))(keys)
    )
    found = [np.mean(drawn[:, : 20000 - k] * drawn[:, k:]) for k in range(4)]
    np.testing.assert_allclose(found, 0.8 ** np.arange(4) / 0.36, rtol=0.04)


@thorough
def test_bootstrap_is_reproducible_by_seed():
    estimate = fitted(white())
    one, same, other = (ij.bootstrap(estimate, 20, seed=seed).values for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert not np.allclose(one, other)


def test_bootstrap_refuses_a_single_replicate():
    with pytest.raises(ValueError, match="at least 2"):
        ij.bootstrap(fitted(white()), 1)
