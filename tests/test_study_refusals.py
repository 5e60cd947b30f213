"""Studies that cannot be, and folders that are damaged or hold something else."""

import fcntl
import json
import os
import shutil

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from tiers import quick

pytestmark = quick

DESIGN = ij.SobolSequence({"x": (0.0, 1.0), "y": (0.0, 1.0)}, 32)


def times(factor):
    return lambda x, y: {"z": factor * x + y}


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    ij.study(times(2.0), DESIGN, folder, chunk=8)
    other = tmp_path_factory.mktemp("other")
    ij.study(times(3.0), DESIGN, other, chunk=8)
    return folder, other


@pytest.fixture
def store(undisturbed, tmp_path):
    shutil.copytree(undisturbed[0], tmp_path / "store")
    return tmp_path / "store"


def flipped(path, _):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


DAMAGE = {
    "flipped bit": flipped,
    "truncated": lambda path, _: path.write_bytes(path.read_bytes()[:-1]),
    "empty": lambda path, _: path.write_bytes(b""),
    "longer": lambda path, _: path.write_bytes(path.read_bytes() + b"x"),
    "of another study": lambda path, other: shutil.copy(other / path.name, path),
    "in the wrong place": lambda path, _: shutil.copy(path.with_name("chunk-000002.npy"), path),
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_wrong_chunks_are_noticed_and_computed_anew(damage, store, undisturbed):
    damage(store / "chunk-000001.npy", undisturbed[1])
    with pytest.raises(ij.StudyError, match=r"chunk-000001.npy is damaged or of another study"):
        ij.io.read_study(store)
    said = []
    found = ij.study(times(2.0), DESIGN, store, chunk=8, progress=said.append)
    assert content(store) == content(undisturbed[0])
    (note,) = found.notes
    assert "chunk-000001.npy was damaged or of another study, and was computed anew." in note
    assert [each.done for each in said] == [24, 32]
    assert str(said[0]) == f"{note} 24 of 32 lanes"


def test_missing_chunks_are_computed(store, undisturbed):
    (store / "chunk-000003.npy").unlink()
    (store / "chunk-000002.npy.partial").write_bytes(b"half of it")
    with pytest.raises(ij.StudyError, match=r"chunk-000003.npy is missing; call `study` again"):
        ij.io.read_study(store)
    found = ij.study(times(2.0), DESIGN, store, chunk=8)
    assert found.notes == ()
    assert content(store) == content(undisturbed[0])


def other_function(store):
    ij.study(lambda x, y: {"z": x * y}, DESIGN, store, chunk=8)


def other_constant(store):
    ij.study(times(2.0000001), DESIGN, store, chunk=8)


def other_array(store):
    ij.study(times(jnp.asarray(2.5)), DESIGN, store, chunk=8)


def other_seed(store):
    design = ij.SobolSequence({"x": (0.0, 1.0), "y": (0.0, 1.0)}, 32, seed=1)
    ij.study(times(2.0), design, store, chunk=8)


def other_size(store):
    design = ij.SobolSequence({"x": (0.0, 1.0), "y": (0.0, 1.0)}, 64)
    ij.study(times(2.0), design, store, chunk=8)


def other_chunk(store):
    ij.study(times(2.0), DESIGN, store, chunk=4)


def other_order(store):
    ij.study(times(2.0), DESIGN, store, chunk=8, cost=lambda x, y: x)


def other_units(store):
    ij.study(times(2.0), DESIGN, store, chunk=8, units={"x": "m"})


def other_precision(store):
    with jax.enable_x64(False):
        ij.study(times(2.0), DESIGN, store, chunk=8)


OTHERS = {
    other_function: "a study of another function; name another folder, or delete that one.",
    other_constant: "a study of another function",
    other_array: "a study of another function",
    other_seed: "a study of another design",
    other_size: "a study of another design",
    other_chunk: r"in other chunks \(8, now 4\)",
    other_order: "whose lanes are in another order",
    other_units: r"with other units \(x None, now m\)",
    other_precision: r"in another precision \(float64, now float32\)",
}


@pytest.mark.parametrize(
    ("other", "words"), OTHERS.items(), ids=lambda x: getattr(x, "__name__", "")
)
def test_other_study_refuses_the_folder(other, words, store, undisturbed):
    with pytest.raises(ij.StudyError, match=words):
        other(store)
    assert content(store) == content(undisturbed[0])


def test_other_version_refuses_the_folder(store):
    path = store / "study.json"
    path.write_text(path.read_text().replace(f'"jax": "{jax.__version__}"', '"jax": "0.1.2"'))
    words = f"made with other versions \\(jax 0.1.2, now {jax.__version__}\\)"
    with pytest.raises(ij.StudyError, match=words):
        ij.study(times(2.0), DESIGN, store, chunk=8)


def test_same_function_written_elsewhere_is_accepted(store):
    def another(x, y):
        # Only the comment and the names differ.
        return {"z": 2.0 * x + y}

    assert ij.study(another, DESIGN, store, chunk=8).notes == ()


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": 99}', "\x00"])
def test_damaged_manifest_is_refused(text, store):
    (store / "study.json").write_text(text)
    for attempt in (
        lambda: ij.io.read_study(store),
        lambda: ij.study(times(2.0), DESIGN, store, chunk=8),
    ):
        with pytest.raises(ij.StudyError, match=r"study.json is (damaged|not of a study)"):
            attempt()


def test_folders_of_something_else_are_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("unique")
    with pytest.raises(ij.StudyError, match=r"has files but no study.json; name a new folder"):
        ij.study(times(2.0), DESIGN, tmp_path)
    assert content(tmp_path) == {"thesis.tex": b"unique"}
    with pytest.raises(ij.StudyError, match=r"thesis.tex cannot be the folder of a study"):
        ij.study(times(2.0), DESIGN, tmp_path / "thesis.tex")
    with pytest.raises(ij.StudyError, match=r"study.json cannot be read \(No such file"):
        ij.io.read_study(tmp_path / "nowhere")


def test_second_writer_is_refused(store):
    handle = os.open(store, os.O_RDONLY)
    fcntl.flock(handle, fcntl.LOCK_EX)
    with pytest.raises(ij.StudyError, match="Another process writes into"):
        ij.study(times(2.0), DESIGN, store, chunk=8)
    os.close(handle)
    ij.study(times(2.0), DESIGN, store, chunk=8)


def fails(x, y):
    raise ArithmeticError("own error")


def calls_back(x, y):
    shape = jax.ShapeDtypeStruct((), jnp.result_type(float))
    return jax.pure_callback(lambda x: x, shape, x, vmap_method="sequential")


WRONG = {
    "error of its own": (fails, {}, ArithmeticError, "own error"),
    "names": (lambda a, b: a, {}, TypeError, r"take the parameters x, y by name"),
    "nothing": (lambda x, y: None, {}, ValueError, "must return at least one array"),
    "text": (lambda x, y: {"z": "text"}, {}, TypeError, "Result `z` must be an array of numbers"),
    "taken": (lambda x, y: {"x": y}, {}, ValueError, "Result `x` must have a name of its own"),
    "lane": (lambda x, y: {"lane": y}, {}, ValueError, "Result `lane` must have a name"),
    "twice": (lambda x, y: {"a": {"b": x}, "a.b": y}, {}, ValueError, "Result `a.b` must have"),
    "key": (lambda x, y: jax.random.key(0), {}, TypeError, "Result `value` has type key"),
    "type": (
        lambda x, y: x.astype(jnp.bfloat16),
        {},
        TypeError,
        "Result `value` has type bfloat16",
    ),
    "callback": (calls_back, {}, ValueError, "leave out calls back into Python"),
    "chunk": (times(1.0), {"chunk": 0}, ValueError, "`chunk` must be at least 1"),
    "unit": (times(1.0), {"units": {"w": "m"}}, ValueError, "`units` names `w`, but .* x, y, z"),
    "cost": (times(1.0), {"cost": lambda x, y: [x, y]}, TypeError, "`cost` must return one"),
    "client": (times(1.0), {"client": "tcp://x"}, TypeError, "`client` must be a `distributed.C"),
    "cost names": (times(1.0), {"cost": lambda z: z}, TypeError, "`cost` must take the parameters"),
}


@pytest.mark.parametrize(("function", "options", "kind", "words"), WRONG.values(), ids=WRONG)
def test_wrong_arguments_leave_no_folder(function, options, kind, words, tmp_path):
    with pytest.raises(kind, match=words):
        ij.study(function, DESIGN, tmp_path / "store", **options)
    assert not (tmp_path / "store").exists()


def test_points_that_do_not_match_their_description_are_refused(tmp_path):
    class Own(ij.AbstractDesign):
        values: np.ndarray

        @property
        def names(self):
            return ("x",)

        @property
        def dimensions(self):
            return {"lane": 3}

        def points(self):
            return self.values

    for values, words in (
        (np.ones((2, 1)), r"\(3, 1\) for its dimensions and names, but \(2, 1\)"),
        (np.array([[1.0], [np.nan], [2.0]]), "points that are finite"),
    ):
        with pytest.raises(ValueError, match=words):
            ij.study(lambda x: x, Own(values), tmp_path / "store")


def test_manifest_has_neither_times_nor_places(store):
    text = (store / "study.json").read_text()
    assert json.loads(text)["design"]["seed"] == 0
    assert str(store) not in text
    assert os.uname().nodename not in text
