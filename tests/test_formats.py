"""One record in every format arrives as the same recording; sounds arrive as impacts."""

import math
import wave

import h5py
import numpy as np
import pytest
from scipy import io

import impactjax as ij
from tiers import quick

pytestmark = quick

TS = np.arange(50) / 100
DEGREES = 45 * np.cos(7 * TS)
CHOSEN = """
[read]
column = "x"
quantity = "angle"
unit = "deg"
time_column = "t"
time_unit = "s"
"""


def text(separator, comma=False, header=True):
    rows = [f"{t:.17g}{separator}{x:.17g}" for t, x in zip(TS, DEGREES, strict=True)]
    lines = [f"time [s]{separator}angle [deg]", *rows] if header else rows
    joined = "\n".join(lines)
    return (joined.replace(".", ",") if comma else joined).encode()


def netcdf3(path):
    with io.netcdf_file(path, "w") as file:
        file.createDimension("n", len(TS))
        for name, unit, values in (("time", "s", TS), ("angle", "deg", DEGREES)):
            variable = file.createVariable(name, "d", ("n",))
            variable[:] = values
            variable.units = unit


def hdf5(path):
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["t"], group["x"] = TS, DEGREES
        file.create_dataset("note", data="by hand")


def netcdf4(path):
    with h5py.File(path, "w") as file:
        file["time"], file["angle"] = TS, DEGREES.astype(np.float64)
        file["time"].attrs["units"], file["angle"].attrs["units"] = "s", np.bytes_("deg")


IN_GROUP = CHOSEN.replace('"x"', '"run/x"').replace('"t"', '"run/t"')
FORMATS = {
    "commas.csv": (lambda p: p.write_bytes(text(",")), None),
    "semicolons.csv": (lambda p: p.write_bytes(text(";")), None),
    "decimal-commas.csv": (lambda p: p.write_bytes(text("; ", comma=True)), None),
    "tabs.txt": (lambda p: p.write_bytes(text("\t")), None),
    "decimal-commas.tsv": (lambda p: p.write_bytes(text("\t", comma=True)), None),
    "blanks.txt": (lambda p: p.write_bytes(text("   ")), None),
    "no-header.dat": (
        lambda p: p.write_bytes(text(" ", header=False)),
        CHOSEN.replace('"x"', "2").replace('"t"', "1"),
    ),
    "named.npz": (lambda p: np.savez(p, **{"time [s]": TS, "angle [deg]": DEGREES}), None),
    "chosen.npz": (lambda p: np.savez(p, t=TS, x=DEGREES, other=np.ones(3)), CHOSEN),
    "matrix.npy": (
        lambda p: np.save(p, np.stack([TS, DEGREES], axis=1)),
        CHOSEN.replace('"x"', "2").replace('"t"', "1"),
    ),
    "five.mat": (lambda p: io.savemat(p, {"t": TS, "x": DEGREES, "who": "me"}), CHOSEN),
    "seven.mat": (hdf5, IN_GROUP),
    "three.nc": (netcdf3, None),
    "four.nc": (netcdf4, None),
    "group.h5": (hdf5, IN_GROUP),
    "group.hdf5": (hdf5, IN_GROUP),
}


@pytest.mark.parametrize("name", FORMATS)
def test_all_formats_give_the_same_recording(name, tmp_path):
    write, sidecar = FORMATS[name]
    write(tmp_path / name)
    if sidecar is not None:
        (tmp_path / name).with_suffix(".toml").write_text(sidecar)
    file = ij.io.read_recording(tmp_path / name)
    found = file.recording
    assert isinstance(found, ij.Recording)
    assert isinstance(found.quantity, ij.Angle)
    np.testing.assert_allclose(found.ts, TS, rtol=1e-15)
    np.testing.assert_allclose(found.values, DEGREES * math.pi / 180, rtol=1e-14)
    assert file.notes == ()


@pytest.mark.parametrize("name", ["r.npz", "r.npy", "r.mat", "r.nc", "r.h5", "r.wav"])
@pytest.mark.parametrize(
    "content", [b"", b"rubbish" * 50, b"PK\x03\x04", b"\x89HDF\r\n\x1a\n", b"RIFF"]
)
def test_random_bytes_with_any_suffix_are_refused(name, content, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ij.io.FileError, match=r"not a .* file that can be read|holds no"):
        ij.io.read_recording(tmp_path / name)
    with pytest.raises(ij.io.FileError, match="check the name"):
        ij.io.read_recording(tmp_path / f"missing-{name}")


def test_pickled_code_is_not_executed(tmp_path):
    np.savez(tmp_path / "r.npz", x=np.array([print], object))
    with pytest.raises(ij.io.FileError, match="not a NumPy file that can be read"):
        ij.io.read_recording(tmp_path / "r.npz")


def test_error_of_file_without_numbers_lists_its_content(tmp_path):
    np.savez(tmp_path / "r.npz", note=np.array("by hand"))
    with pytest.raises(ij.io.FileError, match="no list of numbers but only note"):
        ij.io.read_recording(tmp_path / "r.npz")


# Sounds: bounces with ringing and noise at times that are known.

R, FIRST = 0.8, 0.4
BOUNCES = 0.2 + FIRST * (1 - R ** np.arange(9)) / (1 - R)


def sound(rate, times, width=2, channels=1, noise=1e-3):
    rng = np.random.default_rng(4)
    t = np.arange(int(rate * (times[-1] + 0.5))) / rate
    total = noise * rng.standard_normal(len(t))
    for i, begin in enumerate(times):
        s = np.maximum(t - begin, 0)
        ring = np.sin(2 * np.pi * 0.2 * rate * s) * np.exp(-s / 3e-3)
        echo = 0.2 * np.roll(ring, int(8e-3 * rate))
        total += 0.9**i * (ring + echo) + 0.02 * np.sin(2 * np.pi * 100 * t)
    scaled = (total / np.abs(total).max() * (2 ** (8 * width - 1) - 1)).astype("<i4")
    raw = scaled.astype(np.uint8) + 128 if width == 1 else scaled
    frames = np.repeat(raw.astype("<i4"), channels)
    return frames.view(np.uint8).reshape(-1, 4)[:, :width].astype(np.uint8).tobytes()


def write_sound(path, rate, times, width=2, channels=1):
    with wave.open(str(path), "wb") as file:
        file.setnchannels(channels)
        file.setsampwidth(width)
        file.setframerate(rate)
        file.writeframes(sound(rate, times, width, channels))


@pytest.mark.parametrize(
    ("rate", "width", "channels"), [(44100, 2, 1), (48000, 3, 2), (16000, 2, 2), (96000, 4, 1)]
)
def test_onsets_are_accurate_to_a_tenth_of_a_millisecond(rate, width, channels, tmp_path):
    write_sound(tmp_path / "r.wav", rate, BOUNCES, width, channels)
    file = ij.io.read_recording(tmp_path / "r.wav")
    assert isinstance(file.recording, ij.ImpactTimes)
    late = np.asarray(file.recording.times) - BOUNCES
    assert np.ptp(late) < 1e-4
    assert np.all(np.abs(late) < 2e-4)
    assert file.notes == ()


def test_false_and_missed_bounces_in_sound_are_detected(tmp_path):
    kept = np.delete(BOUNCES, 3)
    write_sound(tmp_path / "r.wav", 44100, np.sort(np.append(kept, BOUNCES[1] + 0.13)))
    file = ij.io.read_recording(tmp_path / "r.wav")
    assert isinstance(file.recording, ij.ImpactTimes)
    np.testing.assert_array_equal(file.recording.valid, np.arange(9) != 3)
    np.testing.assert_allclose(file.recording.times, BOUNCES, atol=2e-3)
    assert len(file.notes) == 2
    assert f"heard at {BOUNCES[1] + 0.13:.3f} s" in file.notes[0]


def test_silent_sound_is_refused(tmp_path):
    with wave.open(str(tmp_path / "r.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(44100)
        file.writeframes(b"\0" * 44100)
    with pytest.raises(ij.io.FileError, match="0 impacts were found"):
        ij.io.read_recording(tmp_path / "r.wav")
