"""Smoothing and derivatives by local polynomials (Savitzky-Golay filter)."""

import numpy as np


def savitzky_golay(
    values: np.ndarray, width: int, degree: int, order: int = 0, interval: float = 1.0
) -> np.ndarray:
    """Smoothed samples, or a time derivative of them, from a polynomial fitted to the `width`
    samples around each one (an odd number). Near an end, the polynomial of the first or last
    complete window is used.

    Source: Savitzky and Golay, Analytical Chemistry 36, 1627 (1964).
    """
    half = width // 2
    basis, fits = _basis_and_fits(width, degree, order)
    begin = basis[:half] @ (fits @ values[:width])
    end = basis[half + 1 :] @ (fits @ values[-width:])
    return np.concatenate([begin, np.correlate(values, fits[0]), end]) / interval**order


def weights(width: int, degree: int, order: int, interval: float) -> np.ndarray:
    """Weights of the neighbours of a sample."""
    return _basis_and_fits(width, degree, order)[1][0] / interval**order


def _basis_and_fits(width: int, degree: int, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Powers of the distance from the middle, in samples, and the matrix from the samples of a
    window to the coefficients of a derivative of its polynomial.
    """
    at = np.arange(width) - width // 2
    basis = np.vander(at.astype(float), degree + 1, increasing=True)
    fits = np.polynomial.polynomial.polyder(np.linalg.pinv(basis), order)
    return basis[:, : len(fits)], fits
