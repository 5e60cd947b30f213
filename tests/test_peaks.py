"""Peaks and smoothing agree with SciPy's, which takes half a second to load."""

import numpy as np
import pytest
from scipy import signal

from impactjax._first_look.peaks import peaks
from impactjax._first_look.savitzky_golay import savitzky_golay, weights
from tiers import quick

pytestmark = quick


@pytest.mark.parametrize("prominence", [0.1, 1.0, 4.0])
def test_peaks_have_requested_prominence(prominence):
    """Random walks, and small whole numbers, which have plateaus and equal tops."""
    rng = np.random.default_rng(0)
    for length in range(1, 200):
        walk, steps = rng.standard_normal(length).cumsum(), rng.integers(0, 6, length).astype(float)
        for values in (walk, steps, np.zeros(length)):
            expected, _ = signal.find_peaks(values, prominence=prominence)
            np.testing.assert_array_equal(peaks(values, prominence), expected)


@pytest.mark.parametrize("width", [7, 9, 75])
@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_savitzky_golay_is_exact_for_polynomials(width, degree, order):
    values = np.random.default_rng(1).standard_normal(200)
    found = savitzky_golay(values, width, degree, order, 0.01)
    expected = np.asarray(signal.savgol_filter(values, width, degree, deriv=order, delta=0.01))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    own = weights(width, degree, order, 0.01)
    theirs = np.asarray(signal.savgol_coeffs(width, degree, deriv=order, delta=0.01))
    np.testing.assert_allclose(own[::-1], theirs, atol=1e-9 * np.abs(theirs).max())
