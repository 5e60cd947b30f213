"""The program of a study: its function, traced once for a block of lanes.

It is kept as JAX's portable bytes. So what is computed does not depend on the settings of the
process that computes it, and each process and device compiles the same program, for the same number
of lanes: sharding a longer batch by the compiler changes the last digits of results.
"""

import functools
import itertools
import re
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import export
from jaxtyping import Array, Float, PyTree, Shaped

from impactjax._refusal import check_takes
from impactjax._results import RESULTS
from impactjax._study.design import LANE, AbstractDesign, Points

LaneFunction: TypeAlias = Callable[..., PyTree]
Results: TypeAlias = list[Shaped[np.ndarray, "..."]]

_PLACE = re.compile(r' loc\((?:#loc\d*|unknown|"[^"]*"(?:\(#loc\d*\))?)\)')
_ALONE = "value"  # name of a result that is a single array


class Program(NamedTuple):
    """A traced function of a block of lanes.

    - `serialised`: its portable bytes.
    - `double`: true if it was traced with double precision.
    - `block`: number of lanes.
    """

    serialised: bytes
    double: bool
    block: int


class Variable(NamedTuple):
    """One result of a lane: its name, type and shape, and the meaning of its codes, if it is one of
    `RESULTS`.
    """

    name: str
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    codes: tuple[str, ...]


class Traced(NamedTuple):
    """A function after its tracing: the program, its text, and what it returns."""

    program: Program
    text: str
    variables: tuple[Variable, ...]


def traced(function: LaneFunction, design: AbstractDesign, block: int) -> Traced:
    """The program of a function of named numbers. Errors of the function itself pass through.

    **Raises** `TypeError` or `ValueError` if it does not take these names, returns nothing or
    something that is no array of numbers, or calls back into Python.
    """
    names = design.names
    check_takes("function", function, names)
    found: list[tuple[str, tuple[str, ...]]] = []

    def lane(point: Float[Array, " parameters"]) -> list[Array]:
        tree = function(**{name: point[i] for i, name in enumerate(names)})
        leaves = jax.tree_util.tree_leaves_with_path(tree, is_leaf=_is_code)
        found[:] = [(_name(path), _codes() if _is_code(leaf) else ()) for path, leaf in leaves]
        return [_as_array(_name(path), leaf) for path, leaf in leaves]

    lanes = jax.jit(jax.vmap(lane))
    shape = jax.ShapeDtypeStruct((block, len(names)), jnp.result_type(float))
    try:
        exported = export.export(lanes)(shape)
        serialised = bytes(exported.serialize())
    except NotImplementedError as error:
        raise ValueError(
            f"Argument `function` cannot be written down as a program ({error}); leave out calls "
            "back into Python, such as prints and checks that raise errors."
        ) from error
    variables = tuple(
        Variable(name, np.dtype(out.dtype), out.shape[1:], codes)
        for (name, codes), out in zip(found, exported.out_avals, strict=True)
    )
    _check_variables(variables, [*names, *design.dimensions, LANE])
    double = shape.dtype == np.float64
    return Traced(Program(serialised, double, block), _text(exported), variables)


def _text(exported: export.Exported) -> str:
    """The text of a program with all its constants, without places in source files."""
    lines = exported.mlir_module().splitlines()
    return _PLACE.sub("", "\n".join(line for line in lines if not line.startswith("#loc")))


def evaluated(program: Program, points: Points) -> Results:
    """The results of some lanes, computed block by block on all devices of this process."""
    missing = -len(points) % program.block
    padded = np.pad(points, ((0, missing), (0, 0)), mode="edge")
    blocks = padded.reshape(-1, program.block, padded.shape[1])
    devices = jax.local_devices()
    compiled = _compiled(program)

    def on(block: Points, device: Any) -> Results:  # noqa: ANN401  JAX has no type for it
        with jax.enable_x64(program.double):  # holds for one thread
            return [np.asarray(each) for each in compiled(jax.device_put(block, device))]

    with ThreadPoolExecutor(min(len(devices), len(blocks))) as pool:
        found = [*pool.map(on, blocks, itertools.cycle(devices))]
    return [np.concatenate(each)[: len(points)] for each in zip(*found, strict=True)]


@functools.lru_cache(maxsize=2)
def _compiled(program: Program) -> Callable[[Array], list[Array]]:
    return jax.jit(export.deserialize(bytearray(program.serialised)).call)


@functools.cache
def _codes() -> tuple[str, ...]:
    """The message of each result code, in the order of the codes."""

    def item(code: int) -> PyTree:
        return jax.tree.map(lambda _: np.asarray(code, np.int32), RESULTS.successful)

    return tuple(RESULTS[item(code)] for code in range(len(RESULTS)))


def _is_code(leaf: PyTree) -> bool:
    return isinstance(leaf, RESULTS)


def _name(path: tuple[Any, ...]) -> str:
    return jax.tree_util.keystr(path, simple=True, separator=".") or _ALONE


def _as_array(name: str, leaf: PyTree) -> Array:
    if _is_code(leaf):
        (leaf,) = jax.tree.leaves(leaf)
    if not eqx.is_array_like(leaf):
        raise TypeError(f"Result `{name}` must be an array of numbers, but it is {leaf!r}.")
    array = jnp.asarray(leaf)
    if jnp.issubdtype(array.dtype, jax.dtypes.extended) or np.dtype(array.dtype).kind == "V":
        raise TypeError(
            f"Result `{name}` has type {array.dtype}, which NumPy cannot write; convert it."
        )
    return array


def _check_variables(variables: Sequence[Variable], taken: list[str]) -> None:
    """Raises `ValueError` for no results, or some whose names are taken."""
    if not variables:
        raise ValueError("Argument `function` must return at least one array.")
    for each in variables:
        if each.name in taken:
            raise ValueError(
                f"Result `{each.name}` must have a name of its own, which differs from those of "
                "parameters and of other results."
            )
        taken.append(each.name)
