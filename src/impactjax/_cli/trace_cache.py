"""Cache of traced programs on disk.

Tracing an evaluation takes longer than running it, and JAX's own cache keeps compiled programs
only.
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
_DIGEST = hashlib.sha256().digest_size  # bytes of the digest at the beginning of a file

P = ParamSpec("P")
T = TypeVar("T")


class _Program(NamedTuple):
    """A traced program and the structure of its result."""

    call: Callable[..., list[PyTree]]
    example: PyTree  # with a number for each leaf


def kept(function: Callable[P, T], folder: Path) -> Callable[P, T]:
    """A jitted function of this package with its traced programs cached in a folder.

    Arguments may consist of this package's classes only, since a digest of the package's code is
    part of the key. If the file is missing or damaged, the function is traced again.
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
        # NumPy arrays, so that arrays on a device do not cause another compilation.
        found = program.call(*map(np.asarray, arrays))
        return jax.tree.unflatten(jax.tree.structure(program.example), found)

    return call


def _key(function: Callable[..., PyTree], arguments: PyTree) -> str:
    """Digest of everything that a traced program depends on, as the name of its file."""
    leaves, structure = jax.tree.flatten(arguments)
    described = [(leaf.shape, leaf.dtype) if eqx.is_array(leaf) else leaf for leaf in leaves]
    text = repr((_surroundings(), function.__qualname__, str(structure), described))
    return hashlib.sha256(text.encode()).hexdigest()


@functools.cache
def _surroundings() -> tuple[PyTree, ...]:
    """Digest of this package's code, versions of its tools, backend and precision."""
    digest = hashlib.sha256()
    root = Path(__file__).parent.parent
    for path in sorted(root.rglob("*.py")):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    versions = [version(tool) for tool in _TOOLS]
    return digest.hexdigest(), versions, jax.default_backend(), jnp.result_type(float)


def _read(path: Path) -> _Program | None:
    """The program in a file; `None` if the file is missing or damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    head, body = content[:_DIGEST], content[_DIGEST:]
    return _loaded(body) if hashlib.sha256(body).digest() == head else None


def _loaded(body: bytes) -> _Program:
    serialised, example = pickle.loads(body)  # trusted like JAX's compiled programs beside it
    return _Program(jax.jit(export.deserialize(serialised).call), example)


def _written(path: Path, function: Callable[..., PyTree], arguments: PyTree) -> _Program:
    """Traces a function, and writes the program to a file if the folder permits it."""
    arrays, static = eqx.partition(arguments, eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)
    example: PyTree = None

    def flat(*leaves: jax.Array) -> list[PyTree]:
        nonlocal example
        args, kwargs = eqx.combine(jax.tree.unflatten(structure, leaves), static)
        found = function(*args, **kwargs)
        example = jax.tree.map(lambda _: 0, found)
        return jax.tree.leaves(found)

    serialised = export.export(jax.jit(flat))(*leaves).serialize()
    body = pickle.dumps((serialised, example))
    with contextlib.suppress(OSError):  # then the next process traces again
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.with_name(f"{path.name}.{os.getpid()}")
        draft.write_bytes(hashlib.sha256(body).digest() + body)
        draft.replace(path)
    return _loaded(body)
