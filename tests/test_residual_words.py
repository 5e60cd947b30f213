"""Sentences on residuals against their own numbers: constructed residuals, SciPy's limits."""

import re

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import impactjax as ij
from estimates import COUNT, RESIDUAL_TS, leaving
from impactjax._report.residual_words import residual_sentences
from tiers import quick

pytestmark = [quick, pytest.mark.usefixtures("numpy_promotes")]

IMPACTS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)


def white(seed: int, count: int = COUNT) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(count)


def echo(lag: int, share: float, seed: int) -> np.ndarray:
    """Noise with a correlation at one lag only, share/(1 + share²)."""
    noise = white(seed, COUNT + lag)
    return noise[lag:] + share * noise[:-lag]


def chain(share: float, seed: int) -> np.ndarray:
    """First-order autoregressive noise."""
    left = white(seed, COUNT + 200)
    for i in range(1, len(left)):
        left[i] += share * left[i - 1]
    return left[200:]


def limits(left: np.ndarray) -> tuple[bool, bool]:
    """Tests of autocorrelations and runs for independence, by SciPy."""
    n, centred = len(left), left - left.mean()
    lags = range(1, min(40, n // 4) + 1)
    rho = np.array([centred[k:] @ centred[:-k] for k in lags]) / (centred @ centred)
    q = n * (n + 2) * np.sum(rho**2 / (n - np.array(lags)))
    ups = np.sum(left > 0)
    downs = n - ups
    expected = 1 + 2 * ups * downs / n
    variance = (expected - 1) * (expected - 2) / (n - 1)
    runs = 1 + np.sum(np.diff(left > 0))
    far = stats.norm.isf(5e-4) * np.sqrt(variance)
    return bool(q <= stats.chi2.isf(1e-3, len(rho))), bool(abs(runs - expected) <= far)


FAMILIES = [
    *(white(seed) for seed in range(5)),
    *(echo(lag, 0.4, lag) for lag in (1, 2, 5, 17, 40)),
    *(chain(share, 3) for share in (-0.5, 0.1, 0.2, 0.9)),
    white(9) + np.linspace(-1, 1, COUNT),
    np.abs(white(10)) * np.tile([1.0, -1.0], COUNT // 2),
    np.where(white(11) > 0, 1e-3, -1.0),
]


@pytest.mark.parametrize("left", FAMILIES)
def test_independence_sentence_names_the_failed_test(left):
    (said, *_) = residual_sentences(leaving(left))
    uncorrelated, as_many_runs = limits(left)
    assert said.startswith("The residuals look") == (uncorrelated and as_many_runs)
    ljung = re.search(
        r"statistic is ([\d.e+]+) .*?limit ([\d.e+]+);.*?(-?[\d.]+), at lag (\d+)", said
    )
    runs = re.search(r"there are (\d+) runs of one sign \(limits (\d+) to (\d+)\)", said)
    assert (ljung is not None) == (as_many_runs or not uncorrelated)
    assert (runs is not None) == (uncorrelated or not as_many_runs)
    if ljung:
        assert (float(ljung[1]) <= float(ljung[2])) == uncorrelated
    if runs:
        assert (int(runs[2]) <= int(runs[1]) <= int(runs[3])) == as_many_runs


@pytest.mark.parametrize("lag", [5, 17])
def test_independence_sentence_names_the_largest_lag(lag):
    """Lag 1 and the runs are as expected, which is not what the sentence may point at."""
    (said, *_) = residual_sentences(leaving(echo(lag, 0.4, lag)))
    assert said.startswith("The residuals are not independent")
    assert f"at lag {lag})" in said
    assert "runs" not in said


@pytest.mark.parametrize("kept", [6, 20, 40, 150])
def test_masked_residuals_are_ignored(kept):
    """However many are left out, the test rejects independent ones hardly ever."""
    found = []
    for seed in range(40):
        left = np.where(np.arange(COUNT) < kept, white(seed), 0.0)
        whole = leaving(left)
        counts = jnp.arange(COUNT) < kept
        masked = eqx.tree_at(lambda e: e.problem.recording.valid, whole, counts)
        found.append(ij.residual_diagnostics(masked))
        assert np.isfinite(found[-1].correlated)
    assert sum(bool(each.independent) for each in found) >= 39


def test_error_inflation_sentence():
    left = leaving(chain(0.9, 1))
    allowed = eqx.tree_at(lambda e: e.inflation, left, jnp.array([0.8, 3.1]))
    (said, *_) = residual_sentences(allowed)
    assert said.endswith("the errors account for this, by factors from 0.80 to 3.10.")
    plain = eqx.tree_at(lambda e: (e.inflation, e.memory), left, (jnp.ones(2), jnp.array(1)))
    (said, *_) = residual_sentences(plain)
    assert said.endswith("the errors assume independent residuals.")


@pytest.mark.parametrize(
    ("left", "says"),
    [
        (white(1), "consistent with a normal one"),
        (stats.t.rvs(3, size=COUNT, random_state=2), "with longer tails"),
        (stats.uniform.rvs(size=COUNT, random_state=3), "with shorter tails"),
        (stats.gamma.rvs(8, size=COUNT, random_state=4), "it is skewed"),
    ],
)
def test_normality_sentence_names_the_shape(left, says):
    """`limit` is what n/6 S² and n/24 K² of normal residuals exceed once in a thousand times."""
    said = residual_sentences(leaving(left))[-1]
    assert says in said
    skewed, tailed = COUNT / 6 * stats.skew(left) ** 2, COUNT / 24 * stats.kurtosis(left) ** 2
    limit = stats.chi2.isf(1e-3, 2)
    assert ("not normal" in said) == (skewed + tailed > limit)
    assert ("it is skewed" in said) == (skewed > limit)
    assert ("tails" in said) == (tailed > limit)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_noise_gives_no_contact_sentence(share):
    said = [residual_sentences(leaving(chain(share, seed), IMPACTS)) for seed in range(100)]
    assert sum("Just after" in " ".join(each) for each in said) <= 2


def test_long_tails_give_no_contact_sentence():
    rng = np.random.default_rng(6)
    many = [leaving(rng.standard_t(4, COUNT), IMPACTS) for _ in range(100)]
    assert sum("Just after" in " ".join(residual_sentences(each)) for each in many) <= 2


def test_larger_residuals_after_impact_sentence():
    left = white(12)
    near = (RESIDUAL_TS >= 1.5) & (RESIDUAL_TS < 1.625)
    left[near] *= 4
    said = " ".join(residual_sentences(leaving(left, IMPACTS)))
    times = np.sqrt(np.mean(left[near] ** 2) / np.mean(left**2))
    assert f"Just after impact 3 they are up to {times:.2f} times as large" in said
