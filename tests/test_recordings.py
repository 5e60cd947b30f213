"""Every accepted form of a recording arrives in SI units."""

import math

import numpy as np
import pytest

import impactjax as ij
from impactjax._record.outliers import spikes
from records import table
from reference import ball, simulate_rigid
from tiers import quick

pytestmark = quick

TIMES = np.array([0.0, 0.25, 0.5])
DEGREE = math.pi / 180


def read(tmp_path, text, sidecar=None):
    path = tmp_path / "record.csv"
    path.write_text(text, encoding="utf-8")
    if sidecar is not None:
        path.with_suffix(".toml").write_text(sidecar, encoding="utf-8")
    return ij.io.read_recording(path)


def sampled(tmp_path, text, sidecar=None) -> ij.Recording:
    recording = read(tmp_path, text, sidecar).recording
    assert isinstance(recording, ij.Recording)
    return recording


@pytest.mark.parametrize(("unit", "factor"), [("s", 1), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6)])
def test_reader_units_of_time(tmp_path, unit, factor):
    found = sampled(tmp_path, table(f"time [{unit}], angle [rad]", TIMES / factor, [1, 2, 3]))
    np.testing.assert_allclose(found.ts, TIMES, rtol=1e-15)
    np.testing.assert_array_equal(found.values, [1, 2, 3])


@pytest.mark.parametrize(
    ("unit", "factor"), [("rad", 1), ("mrad", 1e-3), ("deg", DEGREE), ("°", DEGREE)]
)
def test_reader_units_of_angle(tmp_path, unit, factor):
    found = sampled(tmp_path, table(f"time [s], angle [{unit}]", TIMES, [45, -3.5, 1e-3]))
    np.testing.assert_allclose(found.values, np.array([45, -3.5, 1e-3]) * factor, rtol=1e-15)
    assert isinstance(found.quantity, ij.Angle)
    assert found.quantity.unit == "rad"


@pytest.mark.parametrize(("unit", "factor"), [("m", 1), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6)])
def test_reader_units_of_displacement(tmp_path, unit, factor):
    found = sampled(tmp_path, table(f"time [s], displacement [{unit}]", TIMES, [200, -1, 0.5]))
    np.testing.assert_allclose(found.values, np.array([200, -1, 0.5]) * factor, rtol=1e-15)
    assert isinstance(found.quantity, ij.Displacement)
    assert found.quantity.unit == "m"


@pytest.mark.parametrize(("unit", "factor"), [("s", 1), ("ms", 1e-3)])
def test_reader_of_impact_times(tmp_path, unit, factor):
    found = read(tmp_path, f"impact time [{unit}]\n127\n314.5\n491\n").recording
    assert isinstance(found, ij.ImpactTimes)
    np.testing.assert_allclose(found.times, np.array([127, 314.5, 491]) * factor, rtol=1e-15)


def test_columns_describing_impacts_are_ignored(tmp_path):
    text = "impact time [s], approach speed [m/s], restitution [1]\n0.1, 2, 0.5\n0.3, 1, 0.5\n"
    found = read(tmp_path, text).recording
    assert isinstance(found, ij.ImpactTimes)
    np.testing.assert_array_equal(found.times, [0.1, 0.3])


@pytest.mark.parametrize(
    "text",
    [
        "time [s], angle [deg]\n0, 45\n0.25, 44\n0.5, 43\n",
        "angle [deg], time [s]\n45, 0\n44, 0.25\n43, 0.5\n",
        "Time [s],Angle [deg]\n0,45\n0.25,44\n0.5,43\n",
        '"time [s]", "angle [deg]"\n"0", "45"\n"0.25", "44"\n"0.5", "43"\n',
        "time[s] ,angle[ deg ]\r\n0,45\r\n0.25,44\r\n0.5,43\r\n",
        "\ufefftime [s], angle [deg]\n0, 45\n\n0.25, +4.4e1\n0.5, 43",
        "time [s], angle [deg],\n0, 45,\n0.25, 44,\n0.5, 43,\n",
    ],
    ids=["usual", "other order", "capitals", "quoted", "Windows", "BOM and blanks", "comma at end"],
)
def test_reader_accepts_csv_dialects(tmp_path, text):
    found = sampled(tmp_path, text)
    np.testing.assert_array_equal(found.ts, TIMES)
    np.testing.assert_allclose(found.values, np.array([45, 44, 43]) * DEGREE, rtol=1e-15)


def test_unused_columns_are_noted(tmp_path):
    text = "time [s], pressure [kPa], angle [deg], note\n0, 101, 1, 0\n1, 102, 2, 0\n"
    file = read(tmp_path, text)
    assert isinstance(file.recording, ij.Recording)
    np.testing.assert_allclose(file.recording.values, np.array([1, 2]) * DEGREE)
    assert file.notes == ("Of the file, `pressure [kPa]`, `note` is not used.",)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("r", [0.3, 0.9])
def test_outlier_samples_are_left_out(noise, r):
    """Outliers only, and no sample of an impact, a quantised record or a step in level."""
    t = np.arange(1500) / 500
    fall = np.abs(np.cos(9 * t)) * r ** np.floor(9 * t / np.pi + 0.5)
    values = fall + noise * np.random.default_rng(2).standard_normal(len(t))
    assert not spikes(values).any()
    assert not spikes(np.round(values / 0.05) * 0.05).any()
    assert not spikes(values + (t > 1.7)).any()
    wrong = np.array([0, 77, 300, 301, 900, 1499])
    values[wrong] += np.array([1, -1, 1, 1, -1, 1]) * 0.7
    np.testing.assert_array_equal(np.flatnonzero(spikes(values)), wrong)


def test_outliers_of_a_velocity_are_left_out():
    """A ball by SciPy. No sample of a rebound is left out, and pulses of an acceleration stay."""
    t = np.arange(1400) / 1000
    clean = simulate_rigid(ball(9.81), [0.3, 0.0], t, lambda speed: 0.8).velocity
    values = clean + 0.02 * np.random.default_rng(2).standard_normal(len(t))
    assert not ij.Recording(t, values, ij.Velocity()).outliers().any()
    wrong = np.array([30, 100, 101, 400, 700])
    values[wrong] += np.array([1, -1, -1, 1, -1]) * 0.8
    found = ij.Recording(t, values, ij.Velocity()).outliers()
    np.testing.assert_array_equal(np.flatnonzero(found), wrong)
    assert not ij.Recording(t, values, ij.Acceleration()).outliers().any()


def test_outliers_of_a_recording_made_in_python_are_left_out():
    """Jumps of ten degrees in a swing against a stop; those of a file are left out as well."""
    t, random = np.arange(1401) / 1000, np.random.default_rng(4)
    values = np.abs(0.7 * np.cos(12.0 * t)) + 3e-3 * random.standard_normal(len(t))
    wrong = random.choice(len(t), 14, replace=False)
    recording = ij.Recording(t, values, ij.Angle())
    jumped = values.copy()
    jumped[wrong] += 10 * DEGREE * random.choice([-1, 1], 14)
    prepared = ij.prepare(ij.Recording(t, jumped, ij.Angle()), laws=["restitution"])
    counted = np.asarray(prepared.experiment.recording.valid)
    assert any("14 of 1401 samples are far from those beside" in note for note in prepared.notes)
    np.testing.assert_array_equal(np.flatnonzero(~counted), np.sort(wrong))
    own, clean = prepared.first_look.oscillator, ij.prepare(recording, laws=["restitution"])
    usual = clean.first_look.oscillator
    assert isinstance(own, ij.Pendulum)
    assert isinstance(usual, ij.Pendulum)
    assert float(own.omega_n) == pytest.approx(float(usual.omega_n), rel=0.01)


def test_sidecar_reads_a_file_without_times(tmp_path):
    """The format of the free pendulum: two other rows, then one number in each line."""
    sidecar = """
    [read]
    skip_rows = 2
    column = 1
    quantity = "angle"
    unit = "deg"
    sample_rate = 500
    window = [0.002, 0.006]
    """
    text = "trigger, rate, duration\n135, 1000, 5 \n-1\n-2\n-3\n-4\n-5\n"
    found = sampled(tmp_path, text, sidecar)
    np.testing.assert_allclose(found.ts, [0.002, 0.004, 0.006], rtol=1e-15)
    np.testing.assert_allclose(found.values, np.array([-2, -3, -4]) * DEGREE, rtol=1e-15)


@pytest.mark.parametrize("column", ["3", '"x"'])
@pytest.mark.parametrize("time_column", ["1", '"t"'])
def test_sidecar_chooses_columns(tmp_path, column, time_column):
    sidecar = f"""
    [read]
    column = {column}
    quantity = "displacement"
    unit = "mm"
    time_column = {time_column}
    time_unit = "ms"
    """
    found = sampled(tmp_path, "t, junk, x\n0, a, 7\n10, b, 8\n", sidecar)
    np.testing.assert_allclose(found.ts, [0, 0.01], rtol=1e-15)
    np.testing.assert_allclose(found.values, [0.007, 0.008], rtol=1e-15)


def test_sidecar_chooses_a_column_whose_header_says_the_rest(tmp_path):
    text = "time [s], angle [deg], displacement [mm]\n0, 1, 2\n1, 3, 4\n"
    sidecar = '[read]\ncolumn = "displacement [mm]"\ntime_column = "time [s]"\n'
    found = sampled(tmp_path, text, sidecar)
    np.testing.assert_allclose(found.values, [0.002, 0.004], rtol=1e-15)


def test_sidecar_gives_the_sample_rate_only(tmp_path):
    found = sampled(tmp_path, "angle [rad]\n1\n2\n3\n", "[read]\nsample_rate = 4.0\n")
    np.testing.assert_array_equal(found.ts, TIMES)


@pytest.mark.parametrize(
    "ticks",
    [[0, 3, 7, 10, 13, 17, 20], [0, 10 / 3, 20 / 3, 10, 80, 250 / 3]],
    ids=["coarse", "gap"],
)
def test_sample_rate_beside_a_clock_that_agrees(tmp_path, ticks):
    text = "time [ms], angle [rad]\n" + "".join(f"{each}, {each}\n" for each in ticks)
    found = sampled(tmp_path, text, "[read]\nsample_rate = 300\n")
    np.testing.assert_allclose(found.ts, np.array(ticks) / 1e3, rtol=1e-15)


def test_sidecar_names_the_column_of_impact_times(tmp_path):
    sidecar = '[read]\ncolumn = "onset"\nquantity = "impact time"\nunit = "ms"\nwindow = [0.2, 1]\n'
    found = read(tmp_path, "bounce, onset\n0, 127\n1, 314\n2, 491\n", sidecar).recording
    assert isinstance(found, ij.ImpactTimes)
    np.testing.assert_allclose(found.times, [0.314, 0.491], rtol=1e-15)


def test_sidecar_path_can_be_given(tmp_path):
    (tmp_path / "record.toml").write_text("this one is not valid")
    (tmp_path / "record.csv").write_text("angle [rad]\n1\n2\n")
    other = tmp_path / "other.toml"
    other.write_text("[read]\nsample_rate = 2\n[fixed]\nlength = 0.07\n[truth]\nr = 0.5\n")
    file = ij.io.read_recording(tmp_path / "record.csv", other)
    assert file.sidecar.fixed == {"length": 0.07}
    assert file.sidecar_path == other


def test_reader_of_a_million_rows(tmp_path):
    ts = np.arange(1_000_000) * 1e-5
    found = sampled(tmp_path, table("time [s], angle [rad]", ts.round(5).tolist(), ts.tolist()))
    np.testing.assert_allclose(found.ts, ts.reshape(-1, 25).mean(axis=1), rtol=1e-12)
    np.testing.assert_allclose(found.values, found.ts, rtol=1e-12)
