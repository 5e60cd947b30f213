"""Pairs of a step and a block of samples, for the evaluation of all samples.

Samples are grouped in blocks of consecutive times. Each step that contains samples of a block is
paired with it and evaluated at all times of the block at once. Each sample then picks its value
from the right pair. This avoids a look-up of the step for each sample.
"""

from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from impactjax._hybrid.varying import alike
from impactjax._types import Samples, Steps

_BLOCK = 16  # samples in a block

_Flags: TypeAlias = Bool[Array, " steps"]


class Pairs(NamedTuple):
    """Pairs of a step and a block of samples, and for each sample the place of its value."""

    step: Int[Array, " pairs"]
    block: Int[Array, " pairs"]
    place: Int[Array, " samples"]  # in the flattened values of all pairs


def in_blocks(ts: Samples) -> Float[Array, "blocks samples_of_block"]:
    """The times of each block; the last one is filled up with its last time."""
    blocks = -(-ts.shape[0] // _BLOCK)
    return jnp.pad(ts, (0, blocks * _BLOCK - ts.shape[0]), mode="edge").reshape(blocks, _BLOCK)


def pairs_of(t: Steps, taken: _Flags, passes: Array, ts: Samples) -> Pairs:
    """The pairs of the steps that start at `t` with the blocks of `ts`."""
    # In a branch of a condition, so that the compiler does not compute it anew for each use.
    return jax.lax.cond(
        passes > 0,
        lambda *each: alike(_pairs(*each), each),
        lambda *each: alike(_no_pairs(*each), each),
        t,
        taken,
        ts,
    )


def _pairs(t: Steps, taken: _Flags, ts: Samples) -> Pairs:
    """The pairs of the steps in a log.

    Example with blocks of 2 samples at ts = 0, 1, ..., 5 and steps that start at 0, 2.5, 2.7, 4:

        step          0        1     2     3
        its samples   0 1 2    -     3     4 5
        its blocks    0 1      -     1     2

        pairs (step, block)   (0, 0)  (0, 1)  (2, 1)  (3, 2)
        first sample          0       2       3       4
        place of the samples  0 1     2       5       6 7

    Sample 3 is the second of block 1 and belongs to pair 2, so that its place is 2 · 2 + 1 = 5.
    """
    samples, rows = ts.shape[0], t.shape[0]
    blocks = -(-samples // _BLOCK)
    count = min(blocks + rows, samples)  # each pair holds a sample
    first = jnp.searchsorted(ts, t, side="left").astype(jnp.int32)
    first = jnp.where(taken, first, samples)
    later = jnp.concatenate([first[1:], jnp.full(1, samples, jnp.int32)])
    end = jax.lax.cummin(later, reverse=True)
    begin_block, end_block = first // _BLOCK, (end - 1) // _BLOCK
    number = jnp.where(end > first, end_block - begin_block + 1, 0)
    offset = jnp.cumsum(number, dtype=jnp.int32) - number

    row = _latest(jnp.where(number > 0, offset, count), count)
    block = begin_block[row] + jnp.arange(count, dtype=jnp.int32) - offset[row]
    exists = jnp.arange(count, dtype=jnp.int32) < offset[-1] + number[-1]
    starts = jnp.where(exists, jnp.maximum(first[row], block * _BLOCK), samples)
    place = _latest(starts, samples) * _BLOCK + jnp.arange(samples, dtype=jnp.int32) % _BLOCK
    return Pairs(row, jnp.clip(block, 0, blocks - 1), place)


def _no_pairs(t: Steps, taken: _Flags, ts: Samples) -> Pairs:
    """Pairs of the right shapes with arbitrary values."""
    del taken
    samples, rows = ts.shape[0], t.shape[0]
    none = jnp.zeros(min(-(-samples // _BLOCK) + rows, samples), jnp.int32)
    return Pairs(none, none, jnp.zeros(samples, jnp.int32))


def _latest(starts: Array, length: int) -> Array:
    """For each position from 0 to length − 1, the index of the last start at or before it.

    Starts at `length` or later are ignored; the others must increase. It is
    `searchsorted(starts, arange(length), side="right") - 1` in linear time. Example: starts 0, 2, 3
    and length 5 give 0, 0, 1, 2, 2.
    """
    numbers = jnp.arange(starts.shape[0], dtype=jnp.int32)
    latest = jax.lax.cummax(jnp.where(starts < length, numbers, 0))
    before = jnp.concatenate([jnp.zeros(1, jnp.int32), latest[:-1]])
    steps = jnp.zeros(length, jnp.int32).at[starts].add(numbers - before, mode="drop")
    return jnp.cumsum(steps, dtype=jnp.int32)
