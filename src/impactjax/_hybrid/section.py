"""The verb `section`: states of a system on a surface, over any number of crossings."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from impactjax._hybrid.arguments import as_tolerance
from impactjax._hybrid.chunks import CHUNK
from impactjax._hybrid.ends import as_scale, as_start, begin, final_of, flow_step, with_arrays
from impactjax._hybrid.equations import Equations
from impactjax._hybrid.lane import Run, Start
from impactjax._hybrid.loop import record_steps
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.path import differentiable_path
from impactjax._hybrid.step import AbstractFlowStep
from impactjax._hybrid.surface import AbstractSurface, Marked
from impactjax._hybrid.system import HybridSystem, State
from impactjax._refusal import check_kind, whole
from impactjax._results import RESULTS
from impactjax._types import Code, Flag, Scalar

_ROWS = 4 * CHUNK  # steps in one part of a run
_IDLE = 1000  # parts in succession without a crossing, after which none is expected


class Crossings(NamedTuple):
    """Times and states at the crossings of a surface.

    - `t`: times.
    - `before`, `after`: states before and after the jump, if there is one.
    """

    t: Float[Array, "... keep"]
    before: State
    after: State


class Section(eqx.Module):
    """States of a lane on a surface; NaN for crossings after a failure or the end of the run.

    - `t`: times of the crossings.
    - `before`, `after`: states before and after the jump; equal where nothing jumps.
    - `final`: where the run has stopped, after the last crossing. A run from there goes on exactly
      as if there had been no cut.
    - `result`: result code.
    """

    t: Float[Array, "... keep"]
    before: State
    after: State
    final: Start
    result: RESULTS


class _Carry(NamedTuple):
    start: Start
    crossings: Crossings
    passed: Code
    idle: Code
    result: RESULTS


def section(
    system: HybridSystem,
    start: Start,
    surface: AbstractSurface,
    *,
    keep: int,
    skip: int = 0,
    tolerance: ArrayLike | None = None,
    scale: State | None = None,
    step: AbstractMethod | None = None,
) -> Section:
    """States at the crossings of a surface.

    Memory does not grow with the number of crossings that are skipped, and no number of steps has
    to be guessed. Differentiable in forward mode; over many crossings of a chaotic motion the
    derivatives grow without limit.

    **Arguments:**

    - `system`, `start`: the system, and where it starts; the `final` of another section with the
      same surface goes on from there.
    - `surface`: `Every` for a time grid, `AtTransition` for events of the system, `Through` for a
      surface in the state space.
    - `keep`: number of crossings returned.
    - `skip`: number of crossings before them that are left out.
    - `tolerance`, `scale`, `step`: as for `solve`.

    **Raises** `ValueError` and `TypeError` as `solve` does.
    """
    check_kind("system", system, HybridSystem, "Ball(gravity, restitution)")
    check_kind("start", start, Start, "Start(t=0.0, y=y0)")
    check_kind("surface", surface, AbstractSurface, "Every(period)")
    keep = whole("keep", keep)
    skip = whole("skip", skip, least=0)
    dtype = jnp.result_type(float, *jax.tree.leaves(start.y))
    allowed = as_tolerance(tolerance, dtype)
    marked = Marked(with_arrays(system, dtype), surface)
    marked.check(start)
    first = start if start.memory is not None else marked.started(start)
    begun = as_start(first, dtype)
    return _section(
        flow_step(step, Equations(marked), begun, allowed),
        keep,
        marked,
        begun,
        jnp.int32(skip),
        jnp.asarray(allowed, dtype),
        as_scale(scale, start.y, dtype),
    )


@eqx.filter_jit
def _section(
    step: AbstractFlowStep,
    keep: int,
    marked: Marked,
    start: Start,
    skip: Code,
    tolerance: Scalar,
    scale: State,
) -> Section:
    equations, number = Equations(marked), jnp.int32(marked.number())
    variable, fixed = eqx.partition(equations, eqx.is_array)
    first = begin(step, equations, start)

    def unfinished(carry: _Carry) -> Flag:
        assert carry.start.memory is not None
        runs = (carry.result == RESULTS.successful) & ~carry.start.memory.ended
        return runs & (carry.passed < skip + keep)

    def one_part(carry: _Carry) -> _Carry:
        point = begin(step, equations, carry.start)
        end = jnp.full_like(point.t, jnp.inf)
        left = skip + keep - carry.passed
        run = Run(variable, point, end, tolerance, scale, number, left, carry.result)
        record = record_steps(step, fixed, _ROWS, jax.lax.stop_gradient(run))
        path = differentiable_path(step, fixed, variable, point.t, point.y, record)
        crosses = record.log.taken & (record.log.event == number)
        place = carry.passed + jnp.cumsum(crosses, dtype=jnp.int32) - 1 - skip
        place = jnp.where(crosses & (place >= 0), place, keep)
        found = Crossings(path.t + path.h, path.end, path.next_y)
        crossings = jax.tree.map(
            lambda kept, new: _placed(kept, new, place), carry.crossings, found
        )
        more = jnp.sum(crosses, dtype=jnp.int32)
        idle = jnp.where(more > 0, 0, carry.idle + 1).astype(jnp.int32)
        full = record.result == RESULTS.max_steps_reached
        result = RESULTS.where(full & (idle < _IDLE), RESULTS.successful, record.result)
        after = final_of(point, path, record)
        return _Carry(after, crossings, carry.passed + more, idle, result)

    def unknown(leaf: Array) -> Array:
        return jnp.full((keep, *leaf.shape), jnp.nan, leaf.dtype)

    nothing = Crossings(*jax.tree.map(unknown, (first.t, first.y, first.y)))
    zero = jnp.int32(0)
    begun = Start(first.t, first.y, first.mode, first.memory)
    carry = _Carry(begun, nothing, zero, zero, RESULTS.successful)
    done = jax.lax.while_loop(unfinished, one_part, carry)
    return Section(*done.crossings, done.start, done.result)


def _placed(kept: Array, new: Array, place: Array) -> Array:
    """Rows with some of the new ones at their places. A select, since some options of the compiler
    abort on a scatter here.
    """
    rows = jnp.arange(kept.shape[0], dtype=place.dtype)
    at = place[None, :] == rows[:, None]
    here = jnp.any(at, axis=1).reshape(-1, *[1] * (kept.ndim - 1))
    return jnp.where(here, new[jnp.argmax(at, axis=1)], kept)
