"""Sobol indices against closed forms, also when lanes fail."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import quick

pytestmark = quick

A, B = 7.0, 0.1
RANGES = dict.fromkeys("xyz", (-math.pi, math.pi))
PARTS = {  # of the variance of Ishigami's function
    "x": 0.5 * (1 + B * math.pi**4 / 5) ** 2,
    "y": A**2 / 8,
    "xz": 8 * B**2 * math.pi**8 / 225,
}
VARIANCE = sum(PARTS.values())
FIRST = np.array([PARTS["x"], PARTS["y"], 0.0]) / VARIANCE
TOTAL = np.array([PARTS["x"] + PARTS["xz"], PARTS["y"], PARTS["xz"]]) / VARIANCE


def ishigami(x, y, z):
    """sin x + a sin² y + b z⁴ sin x: T. Ishigami and T. Homma (1990), ISUMA, 398."""
    return jnp.sin(x) + A * jnp.sin(y) ** 2 + B * z**4 * jnp.sin(x)


def failing(x, y, z):
    """The same, where 5 % of the lanes fail: a hash of their parameters decides."""
    number = jnp.abs(jnp.sin(12.9898 * x + 78.233 * y + 37.719 * z)) * 43758.5453
    fails = number % 1.0 < 0.05
    code = ij.RESULTS.where(fails, ij.RESULTS.step_too_small, ij.RESULTS.successful)
    return {"f": jnp.where(fails, 1e6, ishigami(x, y, z)), "result": code}


def test_indices_of_ishigami_are_those_of_the_closed_form(tmp_path):
    design = ij.Saltelli(RANGES, 1024, second_order=True, seed=1)
    found = ij.sobol_indices(ij.study(ishigami, design, tmp_path), "value")
    assert found.names == ("x", "y", "z")
    assert (found.used, found.left_out, found.failed) == (1024, 0, 0)
    np.testing.assert_allclose(found.first, FIRST, atol=0.02)
    np.testing.assert_allclose(found.total, TOTAL, atol=0.02)
    assert found.second is not None
    assert found.second_error is not None
    second = np.zeros((3, 3))
    second[0, 2] = second[2, 0] = PARTS["xz"] / VARIANCE
    off = ~np.eye(3, dtype=bool)
    np.testing.assert_allclose(found.second[off], second[off], atol=0.03)
    assert np.isnan(np.diagonal(found.second)).all()
    assert (np.abs(found.first - FIRST) <= found.first_error).all()
    assert (np.abs(found.total - TOTAL) <= found.total_error).all()
    assert (found.second_error[off] > 0).all()


def test_failing_lanes_bias_nothing(tmp_path):
    errors = []
    for seed in range(12):
        design = ij.Saltelli(RANGES, 512, seed=seed)
        folder = tmp_path / f"{seed}"
        found = ij.sobol_indices(ij.study(failing, design, folder, chunk=2560), "f")
        assert found.used + found.left_out == 512
        assert 0.04 < found.failed / 2560 < 0.06
        assert 0.7 < found.used / 512 < 0.85  # 0.95⁵ = 0.77
        errors.append([found.first - FIRST, found.total - TOTAL])
    mean, spread = np.mean(errors, axis=0), np.std(errors, axis=0, ddof=1)
    assert (np.abs(mean) < 3.5 * spread / math.sqrt(12)).all()
    assert (np.abs(mean) < 0.02).all()


def test_results_with_axes_have_indices_for_each_number(tmp_path):
    def both(x, y):
        return {"two": jnp.stack([x + 0 * y, x + y, 0 * x + 3.0])}

    ranges = {"x": (0.0, 1.0), "y": (0.0, 1.0)}
    study = ij.study(both, ij.Saltelli(ranges, 256), tmp_path)
    found = ij.sobol_indices(study, "two")
    expected = [[1, 0], [0.5, 0.5]]
    np.testing.assert_allclose(found.first[:2], expected, atol=0.02)
    np.testing.assert_allclose(found.total[:2], expected, atol=0.02)
    assert np.isnan(found.first[2]).all()
    assert found.second is None
    again = ij.sobol_indices(study, "two")
    np.testing.assert_array_equal(again.first_error, found.first_error)


def test_sobol_indices_need_a_saltelli_study(tmp_path):
    sample = ij.study(ishigami, ij.LatinHypercube(RANGES, 8), tmp_path / "sample")
    with pytest.raises(ValueError, match="over the design `Saltelli`"):
        ij.sobol_indices(sample, "value")

    def never(x, y, z):
        return {"f": x / 0.0 * 0.0, "complex": jax.lax.complex(x, y)}

    study = ij.study(never, ij.Saltelli(RANGES, 8), tmp_path / "study")
    with pytest.raises(ValueError, match="There is no result `w`; there are complex, f"):
        ij.sobol_indices(study, "w")
    with pytest.raises(ValueError, match="`complex` must be real numbers"):
        ij.sobol_indices(study, "complex")
    with pytest.raises(ValueError, match="Only 0 of 8 blocks"):
        ij.sobol_indices(study, "f")
