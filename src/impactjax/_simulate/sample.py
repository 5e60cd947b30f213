"""The state at the user's times, from the steps."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, PyTree

from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._simulate.automaton import Automaton
from impactjax._simulate.loop import Log
from impactjax._simulate.replay import Path
from impactjax._simulate.state import Mode, State
from impactjax._simulate.step import AbstractStep
from impactjax._types import Samples, Scalar


def step_of_each_sample(log: Log, ts: Samples) -> Int[Array, " samples"]:
    """The row of the last step that starts no later than each sample."""
    count = ts.shape[0]
    first = jnp.searchsorted(ts, jax.lax.stop_gradient(log.t), side="left")
    first = jnp.where(log.taken, first, count)
    number = jnp.arange(log.t.shape[0], dtype=jnp.int32)
    latest = jax.lax.cummax(jnp.where(log.taken, number, 0))
    before = jnp.concatenate([jnp.zeros(1, jnp.int32), latest[:-1]])
    jumps = jnp.zeros(count, jnp.int32).at[first].add(number - before, mode="drop")
    return jnp.cumsum(jumps)


def sample(
    step: AbstractStep,
    model: ImpactOscillator,
    path: Path,
    log: Log,
    ts: Samples,
    row: Int[Array, " samples"],
) -> State:
    """The state at the times `ts`, each inside the step numbered `row`."""
    automaton = Automaton(model)
    expansions = jax.vmap(lambda t, y, mode, h: step.expand(automaton, t, y, mode, h))(
        path.t, path.y, log.mode, jax.lax.stop_gradient(path.h)
    )
    t, y, mode, expansion = jax.tree.map(
        lambda column: column[row], (path.t, path.y, log.mode, expansions)
    )

    def at(time: Scalar, t: Scalar, y: State, mode: Mode, expansion: PyTree) -> State:
        s = time - t
        return automaton.with_chatter(t, y, mode, s, step.evaluate(automaton, mode, expansion, s))

    return jax.vmap(at)(ts, t, y, mode, expansion)
