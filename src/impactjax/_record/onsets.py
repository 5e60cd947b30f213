"""From the sound of a bouncing ball to the times of its bounces."""

from pathlib import Path

import numpy as np

from impactjax._record.file_error import FileError
from impactjax._record.text import check_is_file, unreadable

_SLOWEST = 8000.0  # [Hz] of sampling
_BAND = 3000.0  # [Hz]; below it rooms hum and hands knock
_SHORT = 3e-4  # [s] over which loudness is taken
_APART = 15e-3  # [s] between onsets at least; echoes fade meanwhile
_LOUDER = 3.0  # than before, in amplitude
_RISE = 0.2  # of the local maximum: the onset


def read_onsets(path: Path) -> np.ndarray:
    """The times [s] at which a WAV file suddenly gets louder. Raises `FileError`.

    An onset is where the sound above 3 kHz, three times as loud as ever during the 15 ms before,
    first reaches a fifth of its local maximum: the same point of every bounce, to some 0.05 ms.
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
    """The first sample around a peak of novelty that reaches a share of the maximum there."""
    begin = max(peak - around, 0)
    near = amplitude[begin : peak + around]
    return begin + int(np.argmax(near >= _RISE * near.max()))


def _read(path: Path) -> tuple[float, np.ndarray]:
    """Samples a second, and the sound, of all channels together."""
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
