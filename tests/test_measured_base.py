"""A measured motion of the base in a sidecar: a column of the same file, or of another one."""

import json

import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from command import impactjax
from pendulum_on_base import LENGTH, OMEGA, ZETA, R, motion
from tiers import quick

TS = np.linspace(0.0, 2.0, 501)
FIXED = f"[fixed]\nlength = {LENGTH}\n"


def shake(t):
    """Acceleration of the base [m/s²]."""
    return 3 * np.sin(18 * t) + 2 * np.cos(31 * t + 0.3) - 1.5 * np.sin(44 * t)


@pytest.fixture(scope="module")
def angles():
    """Angles with noise of 2 mrad."""
    found, _ = motion(shake, TS, TS[[0, -1]], 1e-10)
    return found + 2e-3 * np.random.default_rng(1).standard_normal(TS.size)


def written(folder, header, *columns, sidecar="", name="rig"):
    rows = [",".join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True)]
    (folder / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")
    if sidecar:
        (folder / f"{name}.toml").write_text(sidecar)
    return folder / f"{name}.csv"


def test_command_fits_a_record_on_a_measured_base(tmp_path, angles):
    base = np.linspace(0.0, 2.0, 201)
    noise = 0.002 * np.random.default_rng(5).standard_normal(base.size)
    written(tmp_path, "time [s],acceleration [m/s^2]", base, shake(base) + noise, name="shaker")
    sidecar = f'[base]\nrecording = "shaker.csv"\n{FIXED}[sensor]\ngain = 1\n'
    path = written(tmp_path, "time [s],angle [rad]", TS, angles, sidecar=sidecar)
    out = tmp_path / "out"
    told = impactjax("fit", path, "--law", "restitution", "--out", out)
    assert told.status == 0, told.stderr
    assert "The base moves as measured." in told.stdout
    (fitted,) = json.loads((out / "fit.json").read_text())["fits"]
    found = fitted["parameters"]
    for name, truth in {"omega_n": OMEGA, "r": R, "zeta": ZETA}.items():
        low, high = found[name]["interval95"]
        assert low <= truth <= high, (name, found[name])
    assert found["r"]["standard_error"] < 0.01


def test_column_of_the_same_file_moves_the_base(tmp_path, angles):
    place = shake(TS) / 900
    base = 'column = "floor [mm]"\nquantity = "displacement"'
    sidecar = f'[system]\noscillator = "linear-oscillator"\n[base]\n{base}\n'
    path = written(
        tmp_path, "time [s],x [mm],floor [mm]", TS, angles * 10, place * 1e3, sidecar=sidecar
    )
    prepared = ij.prepare(path, laws=["restitution"])
    recording, oscillator = prepared.experiment.recording, prepared.experiment.model.oscillator
    np.testing.assert_allclose(vars(recording)["values"], angles / 100, atol=1e-8)
    assert not any("floor" in note for note in prepared.notes)
    expected = ij.MeasuredMotion.of_displacement(TS, np.round(place * 1e3, 6) / 1e3)
    own, ts = vars(oscillator)["base"], jnp.asarray(TS)
    np.testing.assert_allclose(own.inertia(ts), expected.inertia(ts), rtol=0, atol=0.03)


@quick
@pytest.mark.parametrize(
    ("base", "said"),
    [
        ('recording = "none.csv"', "none.csv"),
        ('recording = "short.csv"', "short.csv goes from 0 to 1 s"),
        ('recording = "turning.csv"', "turning.csv holds angular velocity"),
        ("column = 3", "rig.csv holds angular velocity"),
        ('recording = "turning.csv"\nquantity = "angle"', "`quantity` says nothing without"),
        ('column = 3\nquantity = "tilt"', "line 3: unknown quantity `tilt`"),
        (
            'column = 3\nquantity = "acceleration"\nunit = "furlong"',
            "line 4: unknown unit of acceleration `furlong`",
        ),
        ('column = "base"', "there is no column `base`"),
        ("column = 3\namplitude = 1.0\nfrequency = 3.0", "a measured motion and a harmonic one"),
    ],
)
def test_measurement_that_does_not_suit_is_refused(tmp_path, base, said):
    short, swing = np.linspace(0.0, 1.0, 51), 0.5 * np.cos(OMEGA * TS)
    written(tmp_path, "time [s],acceleration [m/s^2]", short, shake(short), name="short")
    written(tmp_path, "time [s],angular velocity [rad/s]", TS, swing, name="turning")
    header, sidecar = "time [s],angle [rad],angular velocity [rad/s]", f"[base]\n{base}\n{FIXED}"
    path = written(tmp_path, header, TS, swing, np.gradient(swing, TS), sidecar=sidecar)
    with pytest.raises(ij.io.FileError, match=said):
        ij.prepare(path, laws=["none"])
