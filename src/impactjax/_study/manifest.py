"""The manifest of a study: what identifies it, and with what it was made."""

import dataclasses
import functools
import hashlib
import importlib.metadata
import inspect
import json
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Int, Shaped

from impactjax._study.design import AbstractDesign, Points, digest_of
from impactjax._study.folder import MANIFEST, read
from impactjax._study.program import LaneFunction, Traced, Variable
from impactjax._study.study_error import StudyError

Manifest: TypeAlias = dict[str, Any]  # as in `study.json`

_FORMAT = 1
_TOOLS = ("impactjax", "jax", "jaxlib", "numpy")
_SAID_ONLY = ("name", "source")  # of the function, which is identified by its program


def manifest_of(
    function: LaneFunction,
    traced: Traced,
    design: AbstractDesign,
    points: Points,
    order: Int[np.ndarray, " lanes"] | None,
    chunk: int,
    units: Mapping[str, str],
) -> Manifest:
    """The content of `study.json`. It contains no time and no name of a machine, so that the same
    study has the same bytes anywhere.
    """
    return {
        "format": _FORMAT,
        "function": {
            "name": getattr(function, "__qualname__", type(function).__name__),
            "source": _source(function),
            "program": _digest(traced.text.encode()),
        },
        "design": {
            "kind": type(design).__name__,
            **{each.name: _told(getattr(design, each.name)) for each in dataclasses.fields(design)},
            "names": [*design.names],
            "dimensions": {name: int(size) for name, size in design.dimensions.items()},
            "digest": digest_of(design, points),
        },
        "order": None if order is None else _digest(order.astype("<i8").tobytes()),
        "chunk": chunk,
        "precision": points.dtype.name,
        "units": dict(units),
        "results": [_described(each) for each in traced.variables],
        "made with": {
            **{tool: importlib.metadata.version(tool) for tool in _TOOLS},
            "python": platform.python_version(),
            "backend": jax.default_backend(),
            "code of impactjax": code_digest(),
        },
    }


def as_text(manifest: Manifest) -> bytes:
    """The bytes of `study.json`."""
    return f"{json.dumps(manifest, indent=2)}\n".encode()


def read_manifest(path: Path) -> Manifest:
    """The manifest in a folder. Raises `StudyError` if it is absent or damaged."""
    try:
        manifest = json.loads(read(path / MANIFEST))
    except ValueError as error:
        raise StudyError(
            f"{path / MANIFEST} is damaged; restore it, or name a new folder for the study."
        ) from error
    if not isinstance(manifest, dict) or manifest.get("format") != _FORMAT:
        raise StudyError(
            f"{path / MANIFEST} is not of a study that this version of impactjax can read; name "
            "another folder."
        )
    return manifest


def check_same(path: Path, old: Manifest, new: Manifest) -> None:
    """Raises `StudyError` if a folder holds another study than the one that is asked for."""
    for part, said in _DIFFERENCES.items():
        before, now = _essence(old.get(part)), _essence(new[part])
        if json.dumps(before) != json.dumps(now):
            raise StudyError(
                f"{path} holds a study {said.format(_changes(before, now))}; name another folder, "
                "or delete that one."
            )


_DIFFERENCES = {  # the first one is said, so that causes come before effects
    "precision": "in another precision ({})",
    "made with": "made with other versions ({})",
    "function": "of another function",
    "design": "of another design",
    "order": "whose lanes are in another order, by another `cost`",
    "chunk": "in other chunks ({})",
    "units": "with other units ({})",
    "results": "with other results",
}
_SHOWN = 12  # characters of a digest


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _essence(part: object) -> object:
    if not isinstance(part, dict):
        return part
    return {name: value for name, value in part.items() if name not in _SAID_ONLY}


def _changes(before: object, now: object) -> str:
    """Differences between two parts, such as "jax 0.9.0, now 0.10.2"."""
    if not (isinstance(before, dict) and isinstance(now, dict)):
        return f"{before}, now {now}"
    names = [name for name in now | before if before.get(name) != now.get(name)]
    each = [(name, str(before.get(name)), str(now.get(name))) for name in names]
    return "; ".join(f"{name} {old[:_SHOWN]}, now {new[:_SHOWN]}" for name, old, new in each)


def _source(function: LaneFunction) -> str | None:
    """The function as it is written, if that can be found."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return None


def _told(value: object) -> object:
    """A field of a design as JSON."""
    if isinstance(value, Mapping):
        return {name: _told(each) for name, each in value.items()}
    if eqx.is_array(value):
        return _told_array(np.asarray(value))
    return value if isinstance(value, bool | int | float | str) else repr(value)


def _told_array(values: Shaped[np.ndarray, "..."]) -> str:
    if values.ndim != 1 or not values.size or values.dtype.kind != "f":
        return f"{values.dtype} of shape {values.shape}"
    return f"{values.size} values from {values.min():.17g} to {values.max():.17g}"


def _described(variable: Variable) -> Manifest:
    return {
        "name": variable.name,
        "type": variable.dtype.str,
        "shape": [*variable.shape],
        "codes": [*variable.codes],
    }


@functools.cache
def code_digest() -> str:
    """A digest of the code of this package."""
    root = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
