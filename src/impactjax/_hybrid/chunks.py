"""Maps and scans over rows in chunks, without the chunks beyond the last row in use.

Each chunk is a branch of a condition. If the condition is not batched under `vmap`, unused chunks
cost nothing. The compiler also computes the result of a branch only once, for all its uses.
"""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, PyTree

from impactjax._hybrid.varying import alike

CHUNK = 32  # the number of rows is a multiple of this
FEW_STEPS = 64  # rows that are mapped at once
_FEW_CHUNKS = 2  # written one after the other: outside a loop the compiler sees what is constant

Carry = TypeVar("Carry")
Row = TypeVar("Row")
Out = TypeVar("Out")


def scan_rows(
    body: Callable[[Carry, Row], tuple[Carry, Out]], carry: Carry, rows: Row, used: Array
) -> tuple[Carry, Out]:
    """`lax.scan` over the first `used` rows; the rest of the output is zero."""
    everything = carry, rows

    @jax.jit  # so that it is traced once
    def chunk_body(carry: Carry, chunk: Row) -> tuple[Carry, Out]:
        return jax.lax.scan(lambda *each: alike(body(*each), everything), carry, chunk)

    return _scan_chunks(chunk_body, alike(carry, everything), rows, used, CHUNK)


def map_rows(function: Callable[[Row], Out], rows: Row, used: Array, size: int) -> Out:
    """`vmap` over the first `used` rows, `size` at a time; the rest of the output is zero."""

    @jax.jit  # so that it is traced once
    def chunk_body(nothing: tuple[()], chunk: Row) -> tuple[tuple[()], Out]:
        return nothing, alike(jax.vmap(function)(chunk), rows)

    return _scan_chunks(chunk_body, (), rows, used, size)[1]


def map_some(
    function: Callable[[Row], Out], rows: Row, some: Bool[Array, " rows"], size: int
) -> Out:
    """`vmap` over some of the rows; the output of all others is zero.

    The function is also called for a few rows that are not among them, with no effect.
    """
    count, place = some.shape[0], jnp.cumsum(some, dtype=jnp.int32) - 1
    number = jnp.arange(count, dtype=jnp.int32)
    row = jnp.zeros_like(number).at[jnp.where(some, place, count)].set(number, mode="drop")
    first = jax.tree.map(lambda column: column[row], rows)
    found = map_rows(function, first, _most(place[-1] + 1), min(size, count))

    def spread(column: Array) -> Array:
        own = column[jnp.maximum(place, 0)]
        return jnp.where(some.reshape(-1, *[1] * (own.ndim - 1)), own, 0)

    return jax.tree.map(spread, found)


@jax.custom_batching.custom_vmap
def _most(count: Array) -> Array:
    """The largest count of all lanes, which `vmap` does not batch."""
    return count


@_most.def_vmap
def _(size: int, batched: list[PyTree], counts: Array) -> tuple[Array, bool]:
    del size, batched
    return _most(jnp.max(counts)), False


def _scan_chunks(
    chunk_body: Callable[[Carry, Row], tuple[Carry, Out]],
    carry: Carry,
    rows: Row,
    used: Array,
    size: int,
) -> tuple[Carry, Out]:
    length = jax.tree.leaves(rows)[0].shape[0]
    count = -(-length // size)

    def padded(x: Array) -> Array:
        return jnp.pad(x, [(0, count * size - length), *[(0, 0)] * (x.ndim - 1)], mode="edge")

    chunks = jax.tree.map(lambda x: padded(x).reshape(count, size, *x.shape[1:]), rows)
    example = jax.tree.map(lambda x: x[0], chunks)
    outputs = jax.eval_shape(chunk_body, carry, example)[1]

    def skip(carry: Carry, chunk: Row) -> tuple[Carry, Out]:
        del chunk
        nothing = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), outputs)
        return carry, alike(nothing, rows)

    def if_used(carry: Carry, numbered: tuple[Array, Row]) -> tuple[Carry, Out]:
        number, chunk = numbered
        return jax.lax.cond(number * size < used, chunk_body, skip, carry, chunk)

    if count <= _FEW_CHUNKS:
        parts = []
        for number in range(count):
            chunk = jax.tree.map(lambda x, number=number: x[number], chunks)
            carry, part = if_used(carry, (jnp.full_like(used, number), chunk))
            parts.append(part)
        out = jax.tree.map(lambda *columns: jnp.concatenate(columns), *parts)
    else:
        numbers = jnp.arange(count, dtype=used.dtype)
        carry, out = jax.lax.scan(if_used, carry, (numbers, chunks))
        out = jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), out)
    return carry, jax.tree.map(lambda x: x[:length], out)
