"""Other people's records as they come: a hand at the start, a sound, a clipped accelerometer."""

from pathlib import Path

import numpy as np
import pytest

import impactjax as ij
from command import fitted
from impactjax._record.onsets import read_onsets
from tiers import thorough

REAL = Path(__file__).parents[2] / "shared" / "realdata"
SIDECARS = Path(__file__).parent / "sidecars"
DEGREE = np.pi / 180

pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason=f"there are no recordings in {REAL}")


@thorough
def test_three_pendulum_runs_agree(tmp_path):
    files = sorted((REAL / "free_pendulum").glob("*.txt"))
    runs = [each for each in files if "data" in each.name]
    sidecar = SIDECARS / "pendulum_released.toml"
    found = fitted(tmp_path, *runs, "--sidecar", sidecar, "--law", "none")
    fits = found.document["fits"]
    assert len(fits) == 3
    assert max(fit["rms_residual"]["value"] for fit in fits) <= 0.6 * DEGREE
    assert np.ptp([fit["parameters"]["omega_n"]["value"] for fit in fits]) <= 0.02
    for fit in fits:
        zero = fit["parameters"]["offset"]
        assert zero["standard_error"] < 0.1 * DEGREE
        slow = fit["residuals"]["lasting_correlation"]  # of a model that leaves more than noise
        assert zero["verdict"] == ("undecided" if slow else "identified")
    for (note,), let_go in zip(found.document["notes"].values(), (0.77, 0.65, 0.48), strict=True):
        assert "hand" in note
        assert float(note.split("only ")[1].split()[0]) == pytest.approx(let_go, abs=0.06)
        assert note in " ".join(found.stdout.split())


def test_onsets_agree_with_manual_annotation():
    onsets = read_onsets(REAL / "pingpong_bounce" / "pingpong.wav")
    known = np.loadtxt(
        REAL / "pingpong_bounce" / "derived_onsets.csv", delimiter=",", skiprows=1, usecols=1
    )
    late = np.min(np.abs(onsets - known[:, None]), axis=1)
    assert late.max() < 3e-4
    assert np.median(late) < 3e-5


def test_restitution_from_sound(tmp_path):
    """The author's value is 0.9451."""
    sound = REAL / "pingpong_bounce" / "pingpong.wav"
    found = fitted(tmp_path, sound, "--law", "restitution")
    assert found.parameter("r")["value"] == pytest.approx(0.945, abs=0.003)
    assert found.best["n_samples"] >= 30


@thorough
def test_clipped_landing_gives_bounds(tmp_path):
    """A drop of 2.1 m by its duration; the landing has no spring that is stiff."""
    found = fitted(
        tmp_path,
        *(REAL / "phone_drop" / "fall_10_raw.csv", "--sidecar", SIDECARS / "phone_drop.toml"),
    )
    ((clipped, dropped, *_),) = found.document["notes"].values()
    assert clipped.startswith("4 of 1388 samples are clipped")
    assert "only 2.741 to 3.5" in dropped
    assert "fall from rest" in dropped
    assert 140 < found.best["n_samples"] < 150
    assert found.parameter("x0")["value"] == pytest.approx(2.09, abs=0.05)
    low, _ = found.parameter("omega0")["interval95"]
    assert 0 <= low < found.parameter("omega0")["value"] < 100


def test_read_recording_notes_left_out_samples():
    file = ij.io.read_recording(
        REAL / "phone_drop" / "fall_10_raw.csv", SIDECARS / "phone_drop.toml"
    )
    assert isinstance(file.recording, ij.Recording)
    assert int(file.recording.observations) == 1388 - 4
    assert file.notes == ("4 of 1388 samples are clipped and left out.",)
