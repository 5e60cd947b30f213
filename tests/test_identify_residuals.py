"""Residuals beside independent normal noise: textbook formulas, SciPy, and noise of known kinds."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

import impactjax as ij
from estimates import COUNT, leaving
from estimates import RESIDUAL_TS as TS


@functools.cache
def white() -> np.ndarray:
    return 0.1 * np.random.default_rng(4).standard_normal(COUNT)


def test_autocorrelation_and_ljung_box_test():
    left = white()
    found = ij.residual_diagnostics(leaving(left))
    centred = left - left.mean()
    rho = [np.sum(centred[k:] * centred[:-k]) / np.sum(centred**2) for k in range(1, 41)]
    np.testing.assert_allclose(found.autocorrelation, rho, atol=1e-12)
    q = COUNT * (COUNT + 2) * np.sum(np.square(rho) / (COUNT - np.arange(1, 41)))
    np.testing.assert_allclose(found.correlated, stats.chi2.sf(q, 40), rtol=1e-9)
    np.testing.assert_allclose(found.band, stats.norm.ppf(0.975) / 20, rtol=1e-3)


def test_runs_test():
    left = np.tile([1.0, 2.0, -1.0, 1.0, -3.0], COUNT // 5)
    found = ij.residual_diagnostics(leaving(left))
    assert found.runs == 4 * COUNT // 5
    n1, n2 = 240, 160
    expected = 1 + 2 * n1 * n2 / COUNT
    variance = 2 * n1 * n2 * (2 * n1 * n2 - COUNT) / (COUNT**2 * (COUNT - 1))
    np.testing.assert_allclose(found.runs_expected, expected)
    np.testing.assert_allclose(found.runs_deviation, (320 - expected) / np.sqrt(variance))


def test_jarque_bera_test_agrees_with_scipy():
    for left in (white(), white() ** 3):
        found = ij.residual_diagnostics(leaving(left))
        known = np.asarray(stats.jarque_bera(left))[1]
        np.testing.assert_allclose(found.abnormal, known, rtol=1e-9, atol=1e-300)
        np.testing.assert_allclose(found.skewness, stats.skew(left), rtol=1e-9)
        np.testing.assert_allclose(found.excess_kurtosis, stats.kurtosis(left), rtol=1e-9)


def test_diagnostics_distinguish_white_and_filtered_noise():
    many = 0.1 * np.random.default_rng(5).standard_normal((100, COUNT))
    assert sum(bool(ij.residual_diagnostics(leaving(left)).independent) for left in many) >= 98
    smooth = (many[:, 1:] + many[:, :-1]) / 2
    smooth = np.concatenate([many[:, :1], smooth], axis=1)
    assert not any(bool(ij.residual_diagnostics(leaving(left)).independent) for left in smooth)


def test_larger_residuals_after_impact_are_detected():
    impacts = (1.0, 2.0, 3.0)
    left = white().copy()
    near = (TS >= 2.0) & (TS < 2.25)
    left[near] *= 5
    found = ij.residual_diagnostics(leaving(left, impacts))
    rms = np.sqrt(np.mean(left**2))
    for i, begin in enumerate(impacts):
        window = (begin <= TS) & (begin + 0.25 > TS)
        expected = np.sqrt(np.mean(left[window] ** 2)) / rms
        np.testing.assert_allclose(found.after_impacts[i], expected, rtol=1e-9)
    np.testing.assert_array_equal(found.after_impacts[3:], 0)
    assert found.after_impacts[1] > 2


def test_diagnostics_ignore_invalid_residuals():
    left = white().copy()
    kept = np.ones(COUNT, bool)
    kept[50:] = np.random.default_rng(8).random(COUNT - 50) > 0.3
    left[~kept] = 0.0
    whole = leaving(left)
    masked = eqx.tree_at(lambda e: e.problem.recording.valid, whole, jnp.asarray(kept))
    found = ij.residual_diagnostics(masked)
    alone = left[kept]
    assert int(found.runs) == 1 + np.sum(np.diff(alone > 0))
    np.testing.assert_allclose(found.skewness, stats.skew(alone), rtol=1e-9)
    np.testing.assert_allclose(found.excess_kurtosis, stats.kurtosis(alone), rtol=1e-9)
    np.testing.assert_allclose(found.band, 1.96 / np.sqrt(kept.sum()))
    assert found.independent


def test_residual_diagnostics_are_invariant_under_jit_and_vmap():
    both = [leaving(white()), leaving(white()[::-1].copy())]
    together = jax.tree.map(lambda *x: jnp.stack(x), *[eqx.filter(e, eqx.is_array) for e in both])
    static = eqx.filter(both[0], eqx.is_array, inverse=True)
    found = jax.vmap(lambda e: ij.residual_diagnostics(eqx.combine(e, static)).runs_deviation)(
        together
    )
    alone = [ij.residual_diagnostics(each).runs_deviation for each in both]
    np.testing.assert_allclose(found, alone)
