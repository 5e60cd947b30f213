"""The state at the user's times, from the steps.

Each step that contains samples of a block is evaluated at all times of the block at once, see
`pairs.py`.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array

from impactjax._hybrid.chunks import FEW_STEPS, map_rows
from impactjax._hybrid.pairs import in_blocks, pairs_of
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.lane import Record
from impactjax._simulate.replay import Path, state_within
from impactjax._simulate.state import State
from impactjax._simulate.step import AbstractStep
from impactjax._types import Samples, Scalar


def sample(
    step: AbstractStep, model: ImpactOscillator, path: Path, record: Record, ts: Samples
) -> tuple[Samples, Samples]:
    """Position and velocity at the times `ts`."""
    automaton = Automaton(model)
    log = record.log
    pairs = pairs_of(log.t, log.taken, record.passes, ts)
    few = pairs.step.shape[0] < log.t.shape[0]  # most steps contain no sample
    times = in_blocks(ts)
    blocks = times.shape[0]

    def states(pair: tuple[Array, Array]) -> State:
        row, block = pair
        start = (path.t, path.y, log.mode, log.h, record.whole)
        t, y, mode, h, whole = jax.tree.map(lambda column: column[row], start)
        if few:
            expansion = step.expand(automaton, t, y, mode, *whole)
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
