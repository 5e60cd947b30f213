"""Spectra of records."""

import math

import numpy as np

from impactjax._thesis.constants import RECORD


def power(values: np.ndarray, every: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and the one-sided power density of a record with a Hann window [unit²/Hz].

    **Arguments:**

    - `values`: samples of the record, whose mean is taken away.
    - `every`: interval of the samples [s].
    """
    window = np.hanning(len(values))
    lines = np.fft.rfft(window * (values - values.mean()))
    density = 2 * every * np.abs(lines) ** 2 / np.sum(window**2)
    return np.arange(len(lines)) / (len(values) * every), density


def peak(angle: np.ndarray, every: float) -> float:
    """Frequency of the largest line of a record of 15 s [Hz]."""
    assert round(len(angle) * every) == RECORD
    frequencies, density = power(angle, every)
    return float(frequencies[density.argmax()])


def exact_peak(angle: np.ndarray, omega: float, periods: int) -> float:
    """Frequency of the largest line over whole periods of the base, where no line leaks [Hz]."""
    lines = np.abs(np.fft.rfft(angle - angle.mean()))
    return float(lines.argmax() * omega / (2 * math.pi * periods))
