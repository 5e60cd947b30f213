"""A traced program is kept for a new process, and only where it is surely the same."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import impactjax as ij
from impactjax._fit.kept import kept


@pytest.fixture
def folder(tmp_path):
    before = jax.config.values["jax_compilation_cache_dir"]
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path / "traced"
    jax.config.update("jax_compilation_cache_dir", before)


def program():
    """As a new process would have it, with a count of how often it is traced."""
    traces = []

    def separation(law, speed, step=None):
        traces.append(step)
        return {"speed": law.restitution(speed) * speed, "law": law}

    return kept(separation), traces


LAW, SPEED = ij.LinearRestitution(0.8, 0.1), jnp.array([0.5, 1.0])


def test_a_new_process_does_not_trace_again(folder):
    first, traced = program()
    second, not_traced = program()
    found, again = first(LAW, SPEED), second(LAW, 2 * SPEED)
    np.testing.assert_allclose(found["speed"], (0.8 - 0.1 * SPEED) * SPEED, rtol=1e-15)
    np.testing.assert_allclose(again["speed"], (0.8 - 0.2 * SPEED) * 2 * SPEED, rtol=1e-15)
    assert isinstance(again["law"], ij.LinearRestitution)
    assert len(list(folder.iterdir())) == len(traced) == 1
    assert not not_traced


def test_what_differs_is_traced(folder):
    function, traces = program()
    function(LAW, SPEED)
    function(ij.Restitution(0.5), SPEED)
    function(LAW, SPEED[:1])
    function(LAW, SPEED, step=ij.TaylorStep(order=8))
    function(LAW, SPEED, step=ij.TaylorStep(order=9))
    assert len(list(folder.iterdir())) == len(traces) == 5


def test_a_damaged_file_is_traced_anew(folder):
    program()[0](LAW, SPEED)
    (path,) = folder.iterdir()
    path.write_bytes(path.read_bytes()[:-1])
    function, traces = program()
    function(LAW, SPEED)
    assert len(traces) == 1
    assert program()[0](LAW, SPEED)["speed"].shape == (2,)


class OwnLaw(eqx.Module):
    """Code of which nothing is known in the next process."""

    def restitution(self, speed):
        return 0.5 * jnp.ones_like(speed)


def test_a_users_class_and_transformed_calls_are_not_kept(folder):
    function, traces = program()
    assert np.all(function(OwnLaw(), SPEED)["speed"] == SPEED / 2)
    jax.vmap(function, in_axes=(None, 0))(LAW, SPEED)
    jax.jit(function)(LAW, SPEED)
    function(LAW, SPEED, step=lambda: None)
    assert len(traces) == 4
    assert not folder.exists()


def test_a_folder_that_cannot_be_written_to(folder):
    folder.write_text("not a folder")
    function, traces = program()
    function(LAW, SPEED)
    function(LAW, SPEED)
    assert len(traces) == 1
