"""Errors under correlated residuals and under outliers: their promise, over many replicates."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import linalg, signal

import impactjax as ij
from impactjax._compare.ranking import differences
from impactjax._problem.noise import levinson
from tiers import mostly_thorough, thorough

TS = np.linspace(0.0, 1.0, 201)
X0, SPEED, SIZE = 0.3, 1.5, 2e-3
REPLICATES = 800


def correlated(count: int, share: float) -> np.ndarray:
    """An autoregression of first order whose values have the size SIZE."""
    rng = np.random.default_rng(3)
    white = rng.standard_normal((count, len(TS) + 500)) * SIZE * np.sqrt(1 - share**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -share], white, axis=1))[:, 500:]


def lines(errors: np.ndarray, speed: float = SPEED, **how) -> ij.Estimate[ij.Problem]:
    """A free mass fitted to straight lines with noise, all at once."""

    def one(values):
        recording = ij.Recording(jnp.asarray(TS), values, ij.Displacement())
        model = ij.ImpactOscillator(ij.FreeMass())
        return ij.fit(ij.Experiment(model, recording, ij.InitialState(0.2, speed), **how))

    return jax.jit(jax.vmap(one))(jnp.asarray(X0 + speed * TS + errors))


def coverage(found: ij.Estimate[ij.Problem]) -> np.ndarray:
    truth = np.array([X0, SPEED])
    return np.mean((found.low <= truth) & (truth <= found.high), axis=0)


def behind(ahead: ij.Estimate[ij.Problem], other: ij.Estimate[ij.Problem]) -> np.ndarray:
    """By how much more the criterion of one fit is worse than the best than that of another, for
    many fits.
    """
    found = []
    for i in range(ahead.shape[0]):
        pair = jax.tree.map(lambda leaf, i=i: leaf[i], (ahead, other))
        best, worse = differences(pair)
        found.append(worse - best)
    return np.array(found)


def test_levinson_solves_the_yule_walker_equations():
    covariances = 0.8 ** np.arange(6) + 0.1 * np.cos(np.arange(6))
    weights, variances = levinson(jnp.asarray(covariances))
    for order in range(1, 6):
        expected = linalg.solve_toeplitz(covariances[:order], covariances[1 : order + 1])
        np.testing.assert_allclose(weights[order, :order], expected, rtol=1e-10)
        left = covariances[0] - expected @ covariances[1 : order + 1]
        np.testing.assert_allclose(variances[order], left, rtol=1e-10)
        assert not np.any(weights[order, order:])


def test_score_covariance_follows_autocovariances():
    """Jᵀ Ω J with the Toeplitz matrix of the fitted autoregression, summed term by term."""
    scores = jnp.asarray(correlated(1, 0.7)[0])
    jacobian = np.stack([np.ones(len(TS)), TS], axis=1)
    noise = ij.AutoregressiveNoise(most=1)
    count = jnp.asarray(float(len(TS)))
    assert noise.order(scores, count) == 1
    lagged = np.array([scores[k:] @ scores[: len(scores) - k] for k in (0, 1)]) / len(scores)
    share = lagged[1] / lagged[0]
    omega = linalg.toeplitz(lagged[0] * share ** np.arange(len(TS)))
    expected = jacobian.T @ omega @ jacobian
    found = noise.spread(scores, count, jnp.asarray(jacobian))
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_white_residuals_have_order_zero():
    rng = np.random.default_rng(1)
    found = lines(SIZE * rng.standard_normal((REPLICATES, len(TS))))
    assert np.mean(found.memory == 0) > 0.95
    assert np.all(np.abs(coverage(found) - 0.95) < 0.025)


@pytest.mark.parametrize("share", [0.5, 0.75])
def test_interval_coverage_under_correlated_noise(share):
    noise = correlated(REPLICATES, share)
    found = lines(noise)
    assert np.all((coverage(found) > 0.92) & (coverage(found) < 0.98))
    empirical = np.std(found.values, axis=0)
    np.testing.assert_allclose(np.median(found.standard_errors, axis=0), empirical, rtol=0.15)


@thorough
def test_white_noise_errors_underestimate_under_correlation():
    found = lines(correlated(REPLICATES, 0.9), noise=ij.WhiteNoise())
    assert np.all(coverage(found) < 0.6)


def filtered(cutoff: float, count: int) -> np.ndarray:
    """White noise behind a low-pass, at 1 kHz."""
    white = np.random.default_rng(5).standard_normal((count, 1900))
    sections = signal.butter(2, cutoff, fs=1000.0, output="sos")
    return np.asarray(signal.sosfilt(sections, white, axis=1))[:, 500:]


lasts = jax.jit(jax.vmap(ij.AutoregressiveNoise().lasts, (0, None)))


def lasting(scores: np.ndarray) -> float:
    """Share of records whose correlation lasts longer than the noise model allows for."""
    count = jnp.asarray(float(scores.shape[1]))
    return float(np.mean(lasts(jnp.asarray(scores), count)))


@pytest.mark.parametrize("cutoff", [10.0, 50.0, 450.0])
def test_correlation_of_filtered_noise_does_not_last(cutoff):
    assert lasting(filtered(cutoff, 400)) < 0.02


@pytest.mark.parametrize("frequency", [2.0, 7.0, 15.0])
def test_correlation_of_slow_misfit_lasts(frequency):
    """A misfit of 0.3 times the noise."""
    slow = np.sin(2 * np.pi * frequency * np.arange(1400) / 1000.0)
    noise = np.random.default_rng(6).standard_normal((100, 1400))
    assert lasting(noise + 0.3 * np.sqrt(2) * slow) > 0.95


def test_lasting_correlation_leaves_nothing_identified():
    """A wave beside a straight line, where nothing else is wrong."""
    ts = np.linspace(0.0, 1.0, 1001)
    white = SIZE * np.random.default_rng(7).standard_normal(1001)
    wave = SIZE * np.sin(30 * ts)
    for beside, verdict, reason in (
        (0.0, ij.Verdict.IDENTIFIED, ij.Reason.BOUNDED),
        (wave, ij.Verdict.UNDECIDED, ij.Reason.LASTING_CORRELATION),
    ):
        recording = ij.Recording(ts, X0 + SPEED * ts + white + beside, ij.Displacement())
        model = ij.ImpactOscillator(ij.FreeMass())
        found = ij.fit(ij.Experiment(model, recording, ij.InitialState(0.2, SPEED)))
        for each in (found, ij.profiled(found)):
            assert [each.verdict(name) for name in each.names] == [verdict] * 2
            assert [each.reason(name) for name in each.names] == [reason] * 2


LOSSES = [ij.SoftL1(SIZE), ij.Cauchy(2 * SIZE), ij.StudentT(SIZE)]


@pytest.mark.parametrize("loss", mostly_thorough(LOSSES, LOSSES[0]))
def test_robust_fit_ignores_outliers(loss):
    rng = np.random.default_rng(2)
    noise = SIZE * rng.standard_normal((REPLICATES, len(TS)))
    noise += np.where(rng.random(noise.shape) < 0.1, 30 * SIZE * rng.random(noise.shape), 0.0)
    robust, plain = lines(noise, loss=loss), lines(noise)
    truth = np.array([X0, SPEED])
    worst = np.sqrt(np.mean((plain.values - truth) ** 2, axis=0))
    error = np.sqrt(np.mean((robust.values - truth) ** 2, axis=0))
    assert np.all(error < worst / 3)
    spread = np.std(robust.values, axis=0)
    np.testing.assert_allclose(np.median(robust.standard_errors, axis=0), spread, rtol=0.1)


@pytest.mark.parametrize("loss", [ij.Squares(), ij.SoftL1(0.3), ij.Cauchy(0.3), ij.StudentT(0.3)])
def test_losses_are_quadratic_for_small_residuals(loss):
    small, large = jnp.array([0.0, 1e-5]), jnp.array([3.0])
    np.testing.assert_allclose(loss.cost(small), small**2 / 2, atol=1e-18)
    np.testing.assert_allclose(loss.weight(small), 1.0, atol=1e-7)
    expected = (loss.cost(large + 1e-6) - loss.cost(large - 1e-6)) / 2e-6
    np.testing.assert_allclose(loss.score(large), expected, rtol=1e-8)
    assert isinstance(loss, ij.Squares) or loss.weight(large)[0] < 0.2


@thorough
def test_qaic_ignores_extra_parameter_under_ar_noise():
    """A mass at rest, fitted with and without a speed: it moves by nothing but its noise."""
    noise = correlated(REPLICATES, 0.75)
    moving, still = lines(noise, speed=0.0), lines(noise, speed=0.0, fixed=("x_dot0",))
    assert np.mean(still.aic - moving.aic > 10) > 0.05
    assert np.mean(behind(moving, still) > 10) < 0.005


@thorough
def test_qaic_of_independent_residuals_is_aic():
    """But for its term for few observations, 2 k (k + 1)/(n − k − 1), with k of 3 and 2."""
    noise = SIZE * np.random.default_rng(4).standard_normal((20, len(TS)))
    moving, still = lines(noise), lines(noise, fixed=("x_dot0",))
    white = np.asarray(moving.memory == 0)
    n = len(TS)
    expected = still.aic - moving.aic + 12 / (n - 3) - 24 / (n - 4)
    found = behind(moving, still)
    np.testing.assert_allclose(found[white], expected[white], rtol=1e-6, atol=1e-6)
