"""Damaged variants of a shipped recording: read for what they are, or refused in a sentence."""

import os

import numpy as np
import pytest
from typer.testing import CliRunner

import impactjax as ij
from damage import READ, REFUSED, TS, XS, Damage
from impactjax._cli.main import app
from tiers import quick

pytestmark = quick


def write(damage: Damage, folder):
    path = folder / damage.name
    path.write_bytes(damage.content)
    if damage.sidecar is not None:
        path.with_suffix(".toml").write_bytes(damage.sidecar)
    return path


@pytest.mark.parametrize("name", READ)
def test_damaged_readable_files_are_read_correctly(name, tmp_path):
    found = ij.io.read_recording(write(READ[name], tmp_path)).recording
    assert isinstance(found, ij.Recording)
    valid = np.asarray(found.valid)
    assert 600 < valid.sum() <= len(TS)
    expected = np.interp(np.asarray(found.ts)[valid], TS, XS) * np.pi / 180
    np.testing.assert_allclose(np.asarray(found.values)[valid], expected, atol=1e-12)
    assert np.min(np.abs(np.asarray(found.ts)[:, None] - TS), axis=1).max() < 1e-12


@pytest.mark.parametrize("name", REFUSED)
def test_unusable_files_are_refused_in_one_sentence(name, tmp_path):
    damage = REFUSED[name]
    path = write(damage, tmp_path)
    before = sorted(path.parent.iterdir())
    run = CliRunner().invoke(app, ["fit", str(path), "--out", str(tmp_path), "--law", "none"])
    assert run.exit_code == 2, run.output
    assert run.stdout == ""
    (line,) = run.stderr.splitlines()
    assert damage.says is not None
    assert damage.says in line
    assert line.startswith("impactjax: ")
    assert line.endswith(".")
    assert len(line) < 700
    assert sorted(path.parent.iterdir()) == before


def test_damage_table_has_enough_variants():
    assert len(READ) + len(REFUSED) > 70


def test_pipe_is_refused_without_blocking(tmp_path):
    os.mkfifo(tmp_path / "record.csv")
    with pytest.raises(ij.io.FileError, match="no ordinary file"):
        ij.io.read_recording(tmp_path / "record.csv")
    with pytest.raises(ij.io.FileError, match="no ordinary file"):
        ij.io.read_recording(tmp_path.joinpath("/dev/zero"))


def test_record_too_varied_to_average_is_refused(tmp_path):
    """Noise, or a vibration too fast to be averaged."""
    fast = np.sin(np.arange(1_000_000) / 20)
    rows = "\n".join(f"{i}, {x:.4f}" for i, x in enumerate(fast.tolist()))
    (tmp_path / "record.csv").write_text(f"time [ms], angle [rad]\n{rows}\n")
    with pytest.raises(ij.io.FileError, match="1000000 rows are too many to fit"):
        ij.io.read_recording(tmp_path / "record.csv")


def test_groups_in_which_a_motion_bends_are_left_out(tmp_path):
    """A parabola that bounces: means hide its kinks, and nothing else."""
    ts = np.arange(100_000) / 1e5
    s = ts % 0.1
    noise = 1e-6 * np.random.default_rng(1).standard_normal(len(ts))
    rows = np.stack([ts, 9.81 / 2 * s * (0.1 - s) + noise], axis=1)
    np.savetxt(tmp_path / "record.csv", rows, "%.9f", ",", header="time_s,height_m", comments="")
    found = ij.io.read_recording(tmp_path / "record.csv")
    assert any("left out, where the motion bends fast" in note for note in found.notes)
    assert isinstance(found.recording, ij.Recording)
    valid, means = np.asarray(found.recording.valid), np.asarray(found.recording.ts)
    nearest = np.abs(means - 0.1 * np.round(means / 0.1))
    inner = nearest[(means > 0.01) & (means < 0.99)]
    assert np.all(nearest[~valid] < 1.2e-4)
    assert np.all(valid[(means > 0.01) & (means < 0.99)] | (inner < 1.2e-4))
    assert np.count_nonzero(~valid) >= 9
