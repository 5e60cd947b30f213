"""The state at the user's times, from the steps.

Samples are taken in blocks of consecutive times. Each step that holds samples of a block is paired
with it and evaluated at all its times at once, without a look-up a sample; each sample then picks
the pair that it belongs to.
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

_BLOCK = 16  # samples


class _Pairs(NamedTuple):
    """Which step is evaluated at which block of samples, and where each sample finds its value."""

    step: Int[Array, " pairs"]
    block: Int[Array, " pairs"]
    place: Int[Array, " samples"]  # in the flattened values of all pairs


def sample(
    step: AbstractStep, model: ImpactOscillator, path: Path, record: Record, ts: Samples
) -> tuple[Samples, Samples]:
    """Position and velocity at the times `ts`."""
    automaton = Automaton(model)
    log = record.log
    # Behind a condition, so that the compiler computes it once, not anew for each of its uses.
    pairs = jax.lax.cond(
        record.passes > 0,
        lambda *each: alike(_pairs(*each), each),
        lambda *each: alike(_no_pairs(*each), each),
        log,
        ts,
    )
    few = pairs.step.shape[0] < log.t.shape[0]  # so few that most steps hold no sample
    blocks = -(-ts.shape[0] // _BLOCK)
    times = jnp.pad(ts, (0, blocks * _BLOCK - ts.shape[0]), mode="edge").reshape(blocks, _BLOCK)

    def states(pair: tuple[Array, Array]) -> State:
        row, block = pair
        start = (path.t, path.y, log.mode, log.h)
        t, y, mode, h = jax.tree.map(lambda column: column[row], start)
        if few:
            expansion = step.expand(automaton, t, y, mode, h)
        else:
            expansion = jax.tree.map(lambda column: column[row], path.expansion)
        begin = jax.lax.stop_gradient(t)
        delay = t - begin

        def at(s: Scalar) -> State:
            return state_within(step, automaton, record.chatters, t, y, mode, expansion, s, delay)

        # Far outside the step its state may overflow, and zero times that is no derivative.
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

    # Mapped one by one, so that the compiler can leave out what nobody uses.
    return column(lambda state: state.position), column(lambda state: state.velocity)


def _pairs(log: Log, ts: Samples) -> _Pairs:
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
    samples, rows = ts.shape[0], log.t.shape[0]
    none = jnp.zeros(min(-(-samples // _BLOCK) + rows, samples), jnp.int32)
    return _Pairs(none, none, jnp.zeros(samples, jnp.int32))


def _latest(starts: Array, length: int) -> Array:
    """At each position, the number of the last start that is not beyond it.

    Starts at `length` or later are left out; the others increase.
    """
    numbers = jnp.arange(starts.shape[0], dtype=jnp.int32)
    latest = jax.lax.cummax(jnp.where(starts < length, numbers, 0))
    before = jnp.concatenate([jnp.zeros(1, jnp.int32), latest[:-1]])
    steps = jnp.zeros(length, jnp.int32).at[starts].add(numbers - before, mode="drop")
    return jnp.cumsum(steps, dtype=jnp.int32)
