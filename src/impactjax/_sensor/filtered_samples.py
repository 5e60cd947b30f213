"""A Butterworth filter of evenly spaced samples in NumPy, where no derivative is needed."""

import numpy as np

from impactjax._sensor.low_pass import Butterworth

Samples = np.ndarray


def filtered_samples(low_pass: Butterworth, values: Samples, rate: float) -> Samples:
    """The filter's output at evenly spaced samples, by the discrete Fourier transform.

    Before the first sample the input was a straight line. What the input does between the samples
    is lost, so that the cutoff must be below half the sampling rate [Hz].
    """
    count, cutoff = len(values), float(low_pass.cutoff)
    k = np.arange(low_pass.order)
    poles = np.exp(1j * np.pi * (2 * k + low_pass.order + 1) / (2 * low_pass.order))
    frequencies = 1j * np.fft.rfftfreq(3 * count, 1 / rate) / cutoff
    response = 1 / np.prod(frequencies[:, None] - poles, axis=1)
    slope = (values[1] - values[0]) * rate
    line = values[0] + slope * np.arange(count) / rate
    delay = np.sum(-1 / poles).real / (2 * np.pi * cutoff)
    rest = values - line
    fade = rest[-1] * np.cos(np.linspace(0, np.pi / 2, count)) ** 2  # no jump at the end
    padded = np.concatenate([rest, fade, np.zeros(count)])
    return line - slope * delay + np.fft.irfft(response * np.fft.rfft(padded), 3 * count)[:count]
