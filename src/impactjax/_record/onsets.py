"""Onsets in a sound: the times of a ball's bounces."""

from pathlib import Path

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.text import check_is_file, unreadable

_SLOWEST = 8000.0  # [Hz], least sampling rate
_BAND = 3000.0  # [Hz], high-pass frequency against hum and knocking
_SHORT = 3e-4  # [s], window of the loudness
_APART = 15e-3  # [s], least distance of onsets; echoes fade in that time
_LOUDER = 3.0  # least ratio of amplitudes after and before an onset
_RISE = 0.2  # share of the local maximum that defines the onset


def read_onsets(path: Path) -> np.ndarray:
    """The times [s] at which a WAV file suddenly gets louder. Raises `FileError`.

    At an onset the sound above 3 kHz is three times as loud as at any time in the 15 ms before. Its
    time is that at which the amplitude first reaches a fifth of the local maximum, which is the
    same point of every bounce to about 0.05 ms.
    """
    from scipy import ndimage, signal

    rate, sound = _read(path)
    if len(sound) < _APART * rate or rate < _SLOWEST:
        problem = f"it has {len(sound)} samples at {rate:g} Hz"
        raise FileError(path, None, problem, "record a longer sound at 8 kHz or more")
    high = signal.butter(4, min(_BAND, rate / 8), "highpass", fs=rate, output="sos")
    amplitude = np.abs(signal.sosfilt(high, sound))
    short, apart = int(_SHORT * rate), int(_APART * rate)
    loudness = ndimage.maximum_filter1d(amplitude, 2 * short + 1)
    earlier = ndimage.maximum_filter1d(amplitude, apart, origin=(apart - 1) // 2)
    earlier = np.concatenate([np.full(2 * short, np.inf), earlier[: -2 * short]])
    quiet = float(np.quantile(loudness, 0.1)) + 1e-9 * float(loudness.max())
    novelty = loudness / np.maximum(earlier, max(quiet, 1e-300))
    peaks, _ = signal.find_peaks(novelty, height=_LOUDER, distance=apart)
    return np.array([_onset(amplitude, peak, 4 * short) for peak in peaks.tolist()]) / rate


def _onset(amplitude: np.ndarray, peak: int, around: int) -> int:
    """The first sample around a peak that reaches a fifth of the local maximum."""
    begin = max(peak - around, 0)
    near = amplitude[begin : peak + around]
    return begin + int(np.argmax(near >= _RISE * near.max()))


def _read(path: Path) -> tuple[float, np.ndarray]:
    """Sampling rate [Hz], and the sound averaged over its channels."""
    import wave

    check_is_file(path)
    try:
        with path.open("rb") as file, wave.open(file) as sound:
            shape = sound.getframerate(), sound.getnchannels(), sound.getsampwidth()
            data = sound.readframes(sound.getnframes())
    except (wave.Error, EOFError) as error:
        remedy = "save the sound as uncompressed WAV (PCM)"
        raise FileError(path, None, "it is not a WAV file that can be read", remedy) from error
    except OSError as error:
        raise unreadable(path, error) from error
    rate, channels, width = shape
    data = data[: len(data) // (width * channels) * width * channels]
    if width == 1:
        samples = np.frombuffer(data, np.uint8).astype(float) - 128
    else:
        shifted = np.zeros((len(data) // width, 4), np.uint8)
        shifted[:, 4 - width :] = np.frombuffer(data, np.uint8).reshape(-1, width)
        samples = shifted.view("<i4")[:, 0].astype(float)
    return float(rate), samples.reshape(-1, channels).mean(axis=1)
