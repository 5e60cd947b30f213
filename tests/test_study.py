"""Studies: what a function returns at all points of a design, and how it comes back."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import quick

pytestmark = quick

GRID = ij.Grid(gamma=np.linspace(0.1, 0.3, 5), speed=np.linspace(1.0, 2.0, 7))
GAMMA, SPEED = np.meshgrid(np.linspace(0.1, 0.3, 5), np.linspace(1.0, 2.0, 7), indexing="ij")


def rebound(gamma, speed):
    """The first three rebounds with a restitution 1 - gamma, and their sum."""
    speeds = speed * (1 - gamma) ** jnp.arange(1.0, 4.0)
    return {"rebound": speeds, "told": {"sum": jnp.sum(speeds), "fast": speed > 1.4}}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A study in chunks of 12 lanes, of which the last has 11, and its folder."""
    folder = tmp_path_factory.mktemp("study") / "new" / "folder"
    said = []
    units = {"gamma": "1", "speed": "m/s", "rebound": "m/s"}
    found = ij.study(rebound, GRID, folder, chunk=12, units=units, progress=said.append)
    return found, folder, said


def test_results_are_those_of_the_function(done):
    found, _, _ = done
    expected = SPEED[..., None] * (1 - GAMMA[..., None]) ** np.arange(1.0, 4.0)
    np.testing.assert_allclose(found["rebound"], expected, rtol=1e-15)
    np.testing.assert_allclose(found["told.sum"], expected.sum(axis=-1), rtol=1e-15)
    np.testing.assert_array_equal(found["told.fast"], SPEED > 1.4)
    np.testing.assert_array_equal(found["gamma"], GAMMA)
    np.testing.assert_array_equal(found["speed"], SPEED)
    assert found["told.fast"].dtype == bool
    assert not found.failed.any()
    assert repr(found) == (
        "Study(gamma 5, speed 7: gamma, speed → rebound, told.fast, told.sum; 0 failed)"
    )
    with pytest.raises(KeyError, match="There is no `height`; there are gamma, speed, rebound"):
        found["height"]


def test_chunk_is_a_numpy_file(done):
    found, folder, _ = done
    records = np.load(folder / "chunk-000002.npy")
    np.testing.assert_array_equal(records["lane"], np.arange(24, 35))
    np.testing.assert_array_equal(records["rebound"], found["rebound"].reshape(35, 3)[24:])
    assert sorted(path.name for path in folder.iterdir()) == [
        *(f"chunk-{number:06d}.npy" for number in range(3)),
        "study.json",
    ]


def test_progress_tells_rate_and_time_left(done):
    said = done[2]
    assert [each.done for each in said] == [0, 12, 24, 35]
    assert str(said[0]) == "0 of 35 lanes"
    assert said[-1].left == 0
    assert str(ij.Progress(100_000, 10_000, 500.0)) == (
        "10000 of 100000 lanes, 500 lanes/s, 0:03:00 left"
    )


@pytest.mark.parametrize(("terminal", "shown"), [("1", True), ("0", False)])
def test_progress_is_shown_on_a_terminal_only(terminal, shown, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("TTY_COMPATIBLE", terminal)
    ij.study(rebound, GRID, tmp_path / "impacts", chunk=12)
    written = capsys.readouterr()
    assert written.out == ""
    assert ("impacts: 35 of 35 lanes" in written.err) == shown
    assert bool(written.err) == shown
    ij.study(rebound, GRID, tmp_path / "impacts", chunk=12, progress=lambda now: None)
    assert capsys.readouterr().err == ""


def test_finished_study_is_not_computed_again(done):
    found, folder, _ = done
    before = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    units = {"gamma": "1", "speed": "m/s", "rebound": "m/s"}
    said = []
    again = ij.study(rebound, GRID, folder, chunk=12, units=units, progress=said.append)
    assert [each.done for each in said] == [35]
    assert {path: path.stat().st_mtime_ns for path in folder.iterdir()} == before
    np.testing.assert_array_equal(again["rebound"], found["rebound"])
    read = ij.io.read_study(folder)
    np.testing.assert_array_equal(read["rebound"], found["rebound"])


def test_dataset_has_dimensions_and_units(done):
    found, _, _ = done
    dataset = found.to_xarray()
    assert dict(dataset.sizes) == {"gamma": 5, "speed": 7, "rebound_0": 3}
    assert dataset["rebound"].dims == ("gamma", "speed", "rebound_0")
    np.testing.assert_array_equal(dataset["speed"], np.linspace(1.0, 2.0, 7))
    assert dataset["speed"].attrs == {"units": "m/s"}
    assert dataset["rebound"].attrs == {"units": "m/s"}
    assert "1 - gamma" in dataset.attrs["function"]
    one = dataset["rebound"].sel(gamma=0.3, speed=2.0, rebound_0=0)
    np.testing.assert_allclose(one, 1.4, rtol=1e-15)


def test_samples_lie_along_lanes(tmp_path):
    design = ij.LatinHypercube({"x": (0.0, 1.0)}, 10)
    found = ij.study(lambda x: 2 * x, design, tmp_path)
    np.testing.assert_array_equal(found["value"], 2 * design.points()[:, 0])
    dataset = found.to_xarray()
    assert dataset["value"].dims == dataset["x"].dims == ("lane",)
    assert found.manifest["design"]["seed"] == 0
    assert found.manifest["made with"]["jax"] == jax.__version__


def test_missing_package_is_named(done, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with pytest.raises(ImportError, match=r"needs xarray: `pip install 'impactjax\[studies\]'`"):
        done[0].to_xarray()


def test_costly_lanes_are_computed_together(tmp_path):
    design = ij.LatinHypercube({"x": (0.0, 1.0)}, 30)
    x = design.points()[:, 0]
    found = ij.study(lambda x: x**2, design, tmp_path, chunk=8, cost=lambda x: jnp.abs(x - 0.5))
    np.testing.assert_allclose(found["value"], x**2, rtol=1e-15)
    chunks = [np.load(tmp_path / f"chunk-{number:06d}.npy") for number in range(4)]
    order = np.concatenate([each["lane"] for each in chunks])
    np.testing.assert_array_equal(order, np.argsort(-np.abs(x - 0.5)))


def test_failed_lanes_keep_code_and_reason(tmp_path):
    def lane(x):
        short, inside = ij.RESULTS.max_steps_reached, ij.RESULTS.starts_inside_stop
        result = ij.RESULTS.where(x < 0.25, short, ij.RESULTS.successful)
        result = ij.RESULTS.where(x > 0.85, inside, result)
        return {"y": jnp.where(x < 0.5, jnp.nan, x), "result": result}

    x = np.linspace(0.0, 1.0, 11)
    found = ij.study(lane, ij.Grid(x=x), tmp_path, chunk=4)
    assert {
        reason.split(".")[0]: [*np.flatnonzero(each)] for reason, each in found.reasons.items()
    } == {
        "The run needs more steps than `max_steps`": [0, 1, 2],
        "The initial position lies inside a rigid stop": [9, 10],
    }
    np.testing.assert_array_equal(found.failed, (x < 0.25) | (x > 0.85))
    np.testing.assert_array_equal(found["y"], np.where(x < 0.5, np.nan, x))
    assert found["result"].dtype == np.int32
    meaning = found.to_xarray()["result"].attrs["meaning"]
    assert [line[:14] for line in meaning.splitlines()] == [
        "0: successful",
        "1: The run nee",
        "4: The initial",
    ]


def test_lane_without_code_fails_by_nan(tmp_path):
    def lane(x):
        return {"y": jnp.stack([x, jnp.log(x)]), "n": jnp.int32(3)}

    found = ij.study(lane, ij.Grid(x=[-1.0, 0.5, 2.0]), tmp_path)
    np.testing.assert_array_equal(found.failed, [True, False, False])
    assert {name: int(each.sum()) for name, each in found.reasons.items()} == {
        "A result is NaN.": 1
    }


def test_single_precision_is_kept(tmp_path):
    with jax.enable_x64(False):
        found = ij.study(lambda x: x / 3, ij.Grid(x=[1.0, 2.0]), tmp_path)
    assert found["value"].dtype == np.float32
    np.testing.assert_array_equal(found["value"], np.array([1, 2], np.float32) / np.float32(3))


def test_greek_names_are_kept(tmp_path):
    found = ij.study(lambda γ: {"λ": 2 * γ}, ij.Grid(γ=[0.1, 0.2]), tmp_path)
    np.testing.assert_array_equal(found["λ"], [0.2, 0.4])
    assert np.load(tmp_path / "chunk-000000.npy").dtype.names == ("lane", "γ", "λ")


def test_designs_of_ones_own_are_used(tmp_path):
    class Corners(ij.AbstractDesign):
        weights: np.ndarray

        @property
        def names(self):
            return ("x", "y")

        @property
        def dimensions(self):
            return {"corner": 3}

        def points(self):
            return np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])

    found = ij.study(lambda x, y: x - y, Corners(np.eye(3)), tmp_path)
    np.testing.assert_array_equal(found["value"], [0.0, 1.0, -1.0])
    assert found.to_xarray()["value"].dims == ("corner",)
    assert found.manifest["design"]["weights"] == "float64 of shape (3, 3)"
