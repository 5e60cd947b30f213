"""Traced programs, kept on disk for the next process.

To trace a search takes longer than to run it, and JAX keeps compiled programs only.
"""

import contextlib
import functools
import hashlib
import os
import pickle
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import export
from jaxtyping import PyTree

_TOOLS = ("jax", "jaxlib", "equinox", "diffrax", "numpy")
_DIGEST = hashlib.sha256().digest_size  # bytes at the head of a file, of all that follows

P = ParamSpec("P")
T = TypeVar("T")


class _Program(NamedTuple):
    call: Callable[..., list]
    example: PyTree  # of what the function returns, a number a leaf


def kept(function: Callable[P, T], folder: Path) -> Callable[P, T]:
    """A jitted function of this package that finds its traced program in a folder, or leaves it
    there.

    For arguments made of this package's classes alone: a digest of its code tells whether a program
    is still right. Without a whole file of the right name the function is traced as ever.
    """
    programs: dict[str, _Program] = {}

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        key = _key(function, (args, kwargs))
        if key not in programs:
            path = folder / key
            programs[key] = _read(path) or _written(path, function, (args, kwargs))
        program = programs[key]
        arrays = jax.tree.leaves(eqx.filter((args, kwargs), eqx.is_array))
        found = program.call(*map(np.asarray, arrays))  # what it returned compiles nothing anew
        return jax.tree.unflatten(jax.tree.structure(program.example), found)

    return call


def _key(function: Callable, arguments: PyTree) -> str:
    """All that the traced program depends on, as the name of a file."""
    leaves, structure = jax.tree.flatten(arguments)
    described = [(leaf.shape, leaf.dtype) if eqx.is_array(leaf) else leaf for leaf in leaves]
    text = repr((_surroundings(), function.__qualname__, str(structure), described))
    return hashlib.sha256(text.encode()).hexdigest()


@functools.cache
def _surroundings() -> tuple:
    """The code of this package, and what runs it."""
    digest = hashlib.sha256()
    root = Path(__file__).parent.parent
    for path in sorted(root.rglob("*.py")):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    versions = [version(tool) for tool in _TOOLS]
    return digest.hexdigest(), versions, jax.default_backend(), jnp.result_type(float)


def _read(path: Path) -> _Program | None:
    """The program in a file; `None` if there is none, or not a whole one."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    head, body = content[:_DIGEST], content[_DIGEST:]
    return _loaded(body) if hashlib.sha256(body).digest() == head else None


def _loaded(body: bytes) -> _Program:
    serialised, example = pickle.loads(body)  # ours, as are the compiled programs beside it
    return _Program(jax.jit(export.deserialize(serialised).call), example)


def _written(path: Path, function: Callable, arguments: PyTree) -> _Program:
    """The program of a function, written to a file if the folder lets us."""
    arrays, static = eqx.partition(arguments, eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)
    example: PyTree = None

    def flat(*leaves: jax.Array) -> list:
        nonlocal example
        args, kwargs = eqx.combine(jax.tree.unflatten(structure, leaves), static)
        found = function(*args, **kwargs)
        example = jax.tree.map(lambda _: 0, found)
        return jax.tree.leaves(found)

    serialised = export.export(jax.jit(flat))(*leaves).serialize()
    body = pickle.dumps((serialised, example))
    with contextlib.suppress(OSError):  # the next process traces again
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.with_name(f"{path.name}.{os.getpid()}")
        draft.write_bytes(hashlib.sha256(body).digest() + body)
        draft.replace(path)
    return _loaded(body)
