"""Traced programs, kept beside the compiled ones.

To trace a search takes longer than to run it. Where JAX keeps compiled programs on disk, as the
command makes it (`jax_compilation_cache_dir`), a new process finds the traced ones there too.
"""

import functools
import hashlib
import os
import pickle
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import export
from jax.core import Tracer
from jaxtyping import PyTree

_PACKAGE = "impactjax"
_TOOLS = ("jax", "jaxlib", "equinox", "diffrax", "numpy")
_FOLDER = "traced"
_DIGEST = hashlib.sha256().digest_size  # bytes at the head of a file, of all that follows

P = ParamSpec("P")
T = TypeVar("T")


class _Program(NamedTuple):
    call: Callable[..., list]
    example: PyTree  # of what the function returns, a number a leaf


def kept(function: Callable[P, T]) -> Callable[P, T]:
    """`equinox.filter_jit` that reads the traced program from disk if it is there.

    Only for arguments whose classes are this package's own: their code is known to be the same by a
    digest of the package. All else is traced as ever.
    """
    traced = eqx.filter_jit(function)
    programs: dict[str, _Program] = {}

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        folder, key = jax.config.values["jax_compilation_cache_dir"], _key(function, (args, kwargs))
        if folder is None or key is None:
            return traced(*args, **kwargs)
        if key not in programs:
            path = Path(folder) / _FOLDER / key
            programs[key] = _read(path) or _written(path, function, (args, kwargs))
        program = programs[key]
        found = program.call(*jax.tree.leaves(eqx.filter((args, kwargs), _is_array)))
        return jax.tree.unflatten(jax.tree.structure(program.example), found)

    return call


def _is_array(leaf: object) -> bool:
    return isinstance(leaf, jax.Array | np.ndarray)


def _key(function: Callable, arguments: PyTree) -> str | None:
    """What the traced program depends on; `None` if it cannot be told."""
    kinds: set[type] = set()

    def see(node: object) -> bool:
        kinds.add(type(node))
        return False

    leaves, structure = jax.tree.flatten(arguments, is_leaf=see)
    if any(isinstance(leaf, Tracer) for leaf in leaves):
        return None
    inner = kinds - {type(leaf) for leaf in leaves}
    if any(kind.__module__.split(".")[0] not in (_PACKAGE, "builtins") for kind in inner):
        return None
    described = [
        (leaf.shape, str(leaf.dtype)) if _is_array(leaf) else (type(leaf), leaf) for leaf in leaves
    ]
    text = repr((function.__module__, function.__qualname__, str(structure), described))
    if " at 0x" in text:  # a function, which nothing tells from another
        return None
    return hashlib.sha256(f"{_surroundings()}{text}".encode()).hexdigest()


@functools.cache
def _surroundings() -> str:
    """The code of this package, and what runs it."""
    digest = hashlib.sha256()
    root = Path(__file__).parent.parent
    for path in sorted(root.rglob("*.py")):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    versions = [version(tool) for tool in _TOOLS]
    return repr((digest.hexdigest(), versions, jax.default_backend(), str(jnp.result_type(float))))


def _read(path: Path) -> _Program | None:
    """The program in a file; `None` if there is none, or not a whole one."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    head, body = content[:_DIGEST], content[_DIGEST:]
    return _loaded(body) if hashlib.sha256(body).digest() == head else None


def _loaded(body: bytes) -> _Program:
    serialised, example = pickle.loads(body)
    return _Program(jax.jit(export.deserialize(serialised).call), example)


def _written(path: Path, function: Callable, arguments: PyTree) -> _Program:
    """The program of a function, written to a file if the folder lets us."""
    arrays, static = eqx.partition(arguments, _is_array)
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
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, draft = tempfile.mkstemp(dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(hashlib.sha256(body).digest() + body)
        os.replace(draft, path)
    except OSError:
        pass  # as JAX does with its compiled programs: the next process traces again
    return _loaded(body)
