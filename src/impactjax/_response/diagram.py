"""The verb `diagram`: stroboscopic states of a forced system over values of a parameter."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int

from impactjax._hybrid.arguments import real
from impactjax._hybrid.ends import as_start, with_arrays
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.numbers import packed
from impactjax._hybrid.section import Section, section
from impactjax._hybrid.surface import Every
from impactjax._hybrid.system import HybridSystem, State
from impactjax._refusal import check_kind, whole
from impactjax._response.parameter import Where, place_of, with_value
from impactjax._response.period import Force, Period, as_function
from impactjax._results import RESULTS
from impactjax._types import Code, Numbers, Scalar


class Sampler(eqx.Module):
    """The stroboscopic section of a system at a value of one of its parameters."""

    system: HybridSystem
    force: Force
    tolerance: ArrayLike | None
    step: AbstractMethod | None
    place: int = eqx.field(static=True)
    keep: int = eqx.field(static=True)
    skip: int = eqx.field(static=True)

    def __call__(self, value: Scalar, start: Start) -> Section:
        system = with_value(self.system, self.place, value)
        return section(
            system,
            start,
            Every(jnp.asarray(self.force(system), value.dtype), start.t),
            keep=self.keep,
            skip=self.skip,
            tolerance=self.tolerance,
            step=self.step,
        )


class AbstractSweep(eqx.Module):
    """Rule for the start at each value of a sweep."""

    @abc.abstractmethod
    def sections(self, run: Sampler, start: Start, values: Float[Array, " values"]) -> Section:
        """The section at each value, in one batch."""


class FreshStarts(AbstractSweep):
    """The same start at each value: all run side by side."""

    def sections(self, run: Sampler, start: Start, values: Float[Array, " values"]) -> Section:
        return jax.vmap(lambda value: run(value, start))(values)


class WithMemory(AbstractSweep):
    """Each value starts where the one before has ended, so that the motion follows a branch as far
    as it is stable. The order of the values is the direction of the sweep.
    """

    def sections(self, run: Sampler, start: Start, values: Float[Array, " values"]) -> Section:
        def following(start: Start, value: Scalar) -> tuple[Start, Section]:
            found = run(value, start)
            good = found.result == RESULTS.successful
            ended = found.final.y, found.final.mode[0]
            y, mode = jax.tree.map(
                lambda new, old: jnp.where(good, new, old), ended, (start.y, start.mode)
            )
            return Start(start.t, y, mode), found

        return jax.lax.scan(following, start, values)[1]


class Diagram(eqx.Module):
    """Stroboscopic states over values of a parameter.

    - `values`: values of the parameter.
    - `states`: states after each period of the force, one column for each.
    - `period`: least number of periods of the force after which the states repeat; 0 if they do not
      repeat within half of them: the motion is quasi-periodic, chaotic or not yet settled.
    - `result`: result codes; states after a failure are NaN.
    """

    values: Float[Array, " values"]
    states: State
    period: Int[Array, " values"]
    result: RESULTS


def diagram(
    system: HybridSystem,
    start: Start,
    period: Period,
    where: Where,
    values: Numbers,
    *,
    sweep: AbstractSweep = FreshStarts(),
    keep: int = 64,
    skip: int = 300,
    repeats: float = 1e-6,
    tolerance: ArrayLike | None = None,
    step: AbstractMethod | None = None,
) -> Diagram:
    """Bifurcation diagram of a forced system: a stroboscopic section at each value of a parameter.

    **Arguments:**

    - `system`, `start`: the system, and where the first motion starts.
    - `period`: period of the force: a number, or a function of the system.
    - `where`: selects the parameter, one number of the system: `lambda system: system.amplitude`.
    - `values`: values of the parameter.
    - `sweep`: `FreshStarts()`, or `WithMemory()` for a sweep in the order of the values.
    - `keep`, `skip`: numbers of periods of the force that are kept, and left out before them.
    - `repeats`: largest difference of states that are the same, in units of the largest state.
    - `tolerance`, `step`: as for `solve`.

    **Raises** `ValueError` for a period that is not positive, and a parameter that is not one real
    number; `TypeError` for arguments of the wrong type.
    """
    check_kind("system", system, HybridSystem, "Ball(gravity, restitution)")
    check_kind("start", start, Start, "Start(t=0.0, y=y0)")
    check_kind("sweep", sweep, AbstractSweep, "WithMemory()")
    keep, skip = whole("keep", keep, least=2), whole("skip", skip, least=0)
    dtype = jnp.result_type(float, *jax.tree.leaves(start.y))
    own = with_arrays(system, dtype)
    place, force = place_of(own, where), as_function(period, own)
    begun = as_start(Start(start.t, start.y, start.mode), dtype)

    run = Sampler(own, force, tolerance, step, place, keep, skip)
    swept = jnp.atleast_1d(jnp.asarray(real("values", values), dtype))
    return _swept(sweep, run, begun, swept, jnp.asarray(repeats, dtype))


@eqx.filter_jit
def _swept(
    sweep: AbstractSweep, run: Sampler, start: Start, values: Array, repeats: Scalar
) -> Diagram:
    found = sweep.sections(run, start, values)
    rows = jax.vmap(jax.vmap(packed))(found.after)
    period = jax.vmap(lambda states: period_of(states, repeats))(rows)
    return Diagram(values, found.after, period, found.result)


def period_of(states: Float[Array, "keep numbers"], repeats: Scalar) -> Code:
    """The least number of rows after which rows repeat, at most half of them; 0 if they do not."""
    count = states.shape[0]
    size = jnp.max(jnp.abs(states), axis=0)
    scaled = states / jnp.where(size > 0, size, 1.0)
    later = [jnp.max(jnp.abs(scaled[lag:] - scaled[:-lag])) for lag in range(1, count // 2 + 1)]
    same = jnp.stack(later) <= repeats
    return jnp.where(jnp.any(same), jnp.argmax(same) + 1, 0).astype(jnp.int32)
