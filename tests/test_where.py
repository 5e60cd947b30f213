"""Where the stop is in a record: the command finds out what the sidecar does not say."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import impactjax as ij
from impactjax._cli.setup import task_of
from impactjax._compare.compare import Setup, compare, laws_for
from impactjax._record.read_recording import read_recording
from impactjax._report.words import sentences
from reference import simulate_rigid

OMEGA, R, NOISE = 25.0, 0.65, 1e-4
TS = np.arange(1000) / 1000


def written(path, values, sidecar=""):
    rows = [f"{t}, {x}" for t, x in zip(TS, values, strict=True)]
    path.write_text("\n".join(["time [s], displacement [m]", *rows]) + "\n", encoding="utf-8")
    path.with_suffix(".toml").write_text(sidecar, encoding="utf-8")
    return read_recording(path)


def impacting(gap):
    """A mass on a spring, from 30 mm, that hits a stop at −gap, by SciPy."""

    def flow(t, y):
        return np.array([y[1], -(OMEGA**2) * (y[0] - gap)])

    found = simulate_rigid(flow, [0.03 + gap, 0.0], TS, lambda speed: R).position - gap
    return found + NOISE * np.random.default_rng(4).standard_normal(len(TS))


@pytest.fixture(scope="module")
def at_rest():
    return impacting(0.0)


@pytest.fixture(scope="module")
def beside():
    return impacting(0.008)


def test_a_stop_where_it_should_be_is_not_looked_for(tmp_path, at_rest):
    task = task_of(written(tmp_path / "a.csv", at_rest), None, None)
    assert (task.notes, task.setup.free, dict(task.setup.start)) == ((), [], {})


def test_a_record_of_the_other_sign_is_turned(tmp_path, at_rest):
    task = task_of(written(tmp_path / "a.csv", -at_rest), None, None)
    (note,) = task.notes
    assert "sign is turned" in note
    assert isinstance(task.recording, ij.Recording)
    np.testing.assert_allclose(task.recording.values, at_rest)


@pytest.mark.parametrize("sidecar", ["[sensor]\ngain = 1.0\n", "[start]\nx0 = -0.03\n"])
def test_a_sign_that_the_sidecar_speaks_of_is_kept(tmp_path, at_rest, sidecar):
    task = task_of(written(tmp_path / "a.csv", -at_rest, sidecar), None, ["restitution"])
    assert isinstance(task.recording, ij.Recording)
    np.testing.assert_allclose(task.recording.values, -at_rest)


def test_a_stop_beside_the_equilibrium_is_to_be_found(tmp_path, beside):
    task = task_of(written(tmp_path / "a.csv", beside), None, None)
    (note,) = task.notes
    assert note.startswith("The impacts seem to be at -7.")
    assert set(task.setup.free) == {"gap", "offset"}
    assert task.setup.start["gap"] == pytest.approx(0.008, abs=5e-4)
    assert "restitution" in task.laws


def test_the_floor_under_a_ball_shows_as_an_offset(tmp_path):
    def flow(t, y):
        return np.array([y[1], -9.80665])

    heights = simulate_rigid(flow, [0.2, 0.0], TS, lambda speed: 0.8).position + 0.5
    task = task_of(written(tmp_path / "a.csv", heights), "bouncing-ball", None)
    assert tuple(task.setup.free) == ("offset",)
    assert task.setup.start["offset"] == pytest.approx(0.5, abs=5e-3)


@pytest.mark.parametrize(
    "sidecar", ["[fixed]\ngap = 0.008\n", '[fit]\nfree = ["gap"]\n', "[sensor]\noffset = 0.0\n"]
)
def test_a_stop_that_the_sidecar_speaks_of_is_left_to_it(tmp_path, beside, sidecar):
    task = task_of(written(tmp_path / "a.csv", beside, sidecar), None, ["restitution"])
    assert task.notes == ()
    assert set(task.setup.free) <= {"gap"}


def test_sharp_turns_are_no_free_swing(tmp_path, beside):
    recording = written(tmp_path / "a.csv", beside).recording
    assert laws_for(recording, Setup("linear-oscillator")) != ["none"]


def test_what_does_not_describe_the_record_identifies_nothing(tmp_path):
    swing = 0.03 * np.cos(OMEGA * TS) + 0.01 * np.cos(1.7 * OMEGA * TS)
    recording = written(tmp_path / "a.csv", swing).recording
    setup = Setup("linear-oscillator", dry_friction=False)
    (fitted,) = compare(recording, setup, ["none"])
    assert float(fitted.estimate.misfit) > 0.05
    assert np.all(np.asarray(fitted.estimate.verdicts) == ij.Verdict.NOT_IDENTIFIED)
    assert any("No law tried describes the record" in each for each in sentences([fitted]))


def test_laws_may_be_fitted_side_by_side(tmp_path):
    noise = NOISE * np.random.default_rng(0).standard_normal(TS.size)
    swing = 0.03 * np.exp(-0.05 * OMEGA * TS) * np.cos(OMEGA * TS) + noise
    recording = written(tmp_path / "a.csv", swing).recording
    setup = Setup("linear-oscillator")
    in_turn = compare(recording, setup, ["none"])
    with ThreadPoolExecutor(2) as pool:
        together = compare(recording, setup, ["none"], each=pool.map)
    assert [each.dry_friction for each in together] == [each.dry_friction for each in in_turn]
    assert sorted(each.dry_friction for each in together) == [False, True]
    for one, other in zip(in_turn, together, strict=True):
        np.testing.assert_array_equal(one.estimate.values, other.estimate.values)
        assert one.estimate.names == other.estimate.names


def test_no_laws_give_no_fits(tmp_path, beside):
    recording = written(tmp_path / "a.csv", beside).recording
    assert compare(recording, Setup("linear-oscillator"), []) == []
