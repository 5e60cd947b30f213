"""A traced program is kept for a new process."""

import jax
import jax.numpy as jnp
import numpy as np

import impactjax as ij
from impactjax._cli.trace_cache import kept


def program(folder):
    """A cached function as in a new process, with a list that grows by each trace."""
    traces = []

    def separation(law, speed, step=None):
        traces.append(step)
        return {"speed": law.restitution(speed) * speed, "law": law}

    return kept(separation, folder), traces


LAW, SPEED = ij.LinearRestitution(0.8, 0.1), jnp.array([0.5, 1.0])


def test_cached_trace_is_reused_by_new_process(tmp_path):
    first, traced = program(tmp_path / "new")
    second, not_traced = program(tmp_path / "new")
    found, again = first(LAW, SPEED), second(LAW, 2 * SPEED)
    np.testing.assert_allclose(found["speed"], (0.8 - 0.1 * SPEED) * SPEED, rtol=1e-15)
    np.testing.assert_allclose(again["speed"], (0.8 - 0.2 * SPEED) * 2 * SPEED, rtol=1e-15)
    assert isinstance(again["law"], ij.LinearRestitution)
    assert len(list((tmp_path / "new").iterdir())) == len(traced) == 1
    assert not not_traced


def test_returned_arrays_do_not_cause_recompilation(tmp_path, caplog):
    function, _ = program(tmp_path)
    with jax.log_compiles():
        again = function(LAW, SPEED)
        for _ in range(2):
            again = function(again["law"], again["speed"])
    assert caplog.text.count("Compiling jit(call)") == 1


def test_different_arguments_are_traced(tmp_path):
    function, traces = program(tmp_path)
    function(LAW, SPEED)
    function(ij.Restitution(0.5), SPEED)
    function(LAW, SPEED[:1])
    function(LAW, SPEED, step=ij.TaylorStep(order=8))
    function(LAW, SPEED, step=ij.TaylorStep(order=9))
    assert len(list(tmp_path.iterdir())) == len(traces) == 5


def test_damaged_cache_file_is_traced_again(tmp_path):
    program(tmp_path)[0](LAW, SPEED)
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:-1])
    function, traces = program(tmp_path)
    function(LAW, SPEED)
    assert len(traces) == 1
    assert program(tmp_path)[0](LAW, SPEED)["speed"].shape == (2,)


def test_read_only_cache_folder(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    function, traces = program(tmp_path / "file")
    function(LAW, SPEED)
    function(LAW, SPEED)
    assert len(traces) == 1
