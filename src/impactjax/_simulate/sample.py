"""The state at the user's times, from the steps.

Samples are grouped in blocks of consecutive times. Each step that contains samples of a block is
paired with it and evaluated at all times of the block at once. Each sample then picks its value
from the right pair. This avoids a look-up of the step for each sample.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.chunks import FEW_STEPS, map_rows
from impactjax._simulate.lane import Log, Record
from impactjax._simulate.replay import Path, state_within
from impactjax._simulate.state import State
from impactjax._simulate.step import AbstractStep
from impactjax._simulate.varying import alike
from impactjax._types import Samples, Scalar

_BLOCK = 16  # samples in a block


class _Pairs(NamedTuple):
    """Pairs of a step and a block of samples, and for each sample the place of its value."""

    step: Int[Array, " pairs"]
    block: Int[Array, " pairs"]
    place: Int[Array, " samples"]  # in the flattened values of all pairs


def sample(
    step: AbstractStep, model: ImpactOscillator, path: Path, record: Record, ts: Samples
) -> tuple[Samples, Samples]:
    """Position and velocity at the times `ts`."""
    automaton = Automaton(model)
    log = record.log
    # In a branch of a condition, so that the compiler does not compute it anew for each use.
    pairs = jax.lax.cond(
        record.passes > 0,
        lambda *each: alike(_pairs(*each), each),
        lambda *each: alike(_no_pairs(*each), each),
        log,
        ts,
    )
    few = pairs.step.shape[0] < log.t.shape[0]  # most steps contain no sample
    blocks = -(-ts.shape[0] // _BLOCK)
    times = jnp.pad(ts, (0, blocks * _BLOCK - ts.shape[0]), mode="edge").reshape(blocks, _BLOCK)

    def states(pair: tuple[Array, Array]) -> State:
        row, block = pair
        start = (path.t, path.y, log.mode, log.h, log.event)
        t, y, mode, h, event = jax.tree.map(lambda column: column[row], start)
        if few:
            expansion = step.expand(automaton, t, y, mode, h, event)
        else:
            expansion = jax.tree.map(lambda column: column[row], path.expansion)
        begin = jax.lax.stop_gradient(t)
        delay = t - begin

        def at(s: Scalar) -> State:
            return state_within(step, automaton, record.chatters, t, y, mode, expansion, s, delay)

        # Far outside the step the state may overflow, which would give NaN derivatives.
        s = times[block] - begin
        end = jax.lax.stop_gradient(h) + 8 * jnp.finfo(h.dtype).eps * jnp.abs(begin)
        return jax.vmap(at)(jnp.where((s >= 0) & (s <= end), s, 0.0))

    def column(part: Callable[[State], Array]) -> Samples:
        values = map_rows(
            lambda pair: part(states(pair)),
            (pairs.step, pairs.block),
            blocks + record.passes,
            blocks + FEW_STEPS,
        )
        return values.reshape(-1)[pairs.place]

    # Mapped separately, so that the compiler can omit one that is not used.
    return column(lambda state: state.position), column(lambda state: state.velocity)


def _pairs(log: Log, ts: Samples) -> _Pairs:
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
    samples, rows = ts.shape[0], log.t.shape[0]
    blocks = -(-samples // _BLOCK)
    count = min(blocks + rows, samples)  # each pair holds a sample
    first = jnp.searchsorted(ts, log.t, side="left").astype(jnp.int32)
    first = jnp.where(log.taken, first, samples)
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
    return _Pairs(row, jnp.clip(block, 0, blocks - 1), place)


def _no_pairs(log: Log, ts: Samples) -> _Pairs:
    """Pairs of the right shapes with arbitrary values."""
    samples, rows = ts.shape[0], log.t.shape[0]
    none = jnp.zeros(min(-(-samples // _BLOCK) + rows, samples), jnp.int32)
    return _Pairs(none, none, jnp.zeros(samples, jnp.int32))


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
