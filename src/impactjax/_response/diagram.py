"""The verb `diagram`: stroboscopic states of a forced system over values of a parameter."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int, PyTree

from impactjax._hybrid.arguments import real
from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.numbers import packed
from impactjax._hybrid.system import HybridSystem, State
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._refusal import check_kind, whole
from impactjax._response.parameter import Where
from impactjax._response.period import Period
from impactjax._response.sampler import (
    AbstractSampler,
    Counts,
    Sampled,
    oscillator_sampler,
    system_sampler,
)
from impactjax._results import RESULTS
from impactjax._simulate.step import AbstractStep
from impactjax._types import Code, Numbers, Scalar


class AbstractSweep(eqx.Module):
    """Rule for the start at each value of a sweep."""

    @abc.abstractmethod
    def sections(
        self, run: AbstractSampler, start: PyTree, values: Float[Array, " values"]
    ) -> Sampled:
        """The states at all values."""


class FreshStarts(AbstractSweep):
    """The same start at each value: all run side by side."""

    def sections(
        self, run: AbstractSampler, start: PyTree, values: Float[Array, " values"]
    ) -> Sampled:
        return run.side_by_side(values, start)


class WithMemory(AbstractSweep):
    """Each value starts where the one before has ended, so that the motion follows a branch as far
    as it is stable. The order of the values is the direction of the sweep. An oscillator ends with
    its last whole step, so that the value changes up to a step before the end of a period.
    """

    def sections(
        self, run: AbstractSampler, start: PyTree, values: Float[Array, " values"]
    ) -> Sampled:
        def one(start: PyTree, value: Scalar) -> tuple[PyTree, Sampled]:
            found = run(value, start)
            return found.following, found

        return jax.lax.scan(one, start, values)[1]


class Diagram(eqx.Module):
    """Stroboscopic states over values of a parameter.

    - `values`: values of the parameter.
    - `states`: states after each period of the force, one column for each; of an impact oscillator
      a dictionary of `position` and `velocity`.
    - `period`: least number of periods of the force after which the states repeat; 0 if they do not
      repeat within half of them: the motion is quasi-periodic, chaotic or not yet settled.
    - `result`: result codes; states after a failure are NaN.
    """

    values: Float[Array, " values"]
    states: State
    period: Int[Array, " values"]
    result: RESULTS


def diagram(
    system: HybridSystem | ImpactOscillator,
    start: Start | InitialState,
    period: Period,
    where: Where,
    values: Numbers,
    *,
    sweep: AbstractSweep = FreshStarts(),
    keep: int = 64,
    skip: int = 300,
    repeats: float = 1e-6,
    tolerance: ArrayLike | None = None,
    step: AbstractMethod | AbstractStep | None = None,
) -> Diagram:
    """Bifurcation diagram of a forced system: a stroboscopic section at each value of a parameter.

    **Arguments:**

    - `system`, `start`: the system, and where the first motion starts: for an `ImpactOscillator` an
      `InitialState`, at time 0. Oscillators run by `simulate`, which is many times faster.
    - `period`: period of the force: a number, or a function of the system.
    - `where`: selects the parameter, one number of the system: `lambda system: system.amplitude`.
    - `values`: values of the parameter.
    - `sweep`: `FreshStarts()`, or `WithMemory()` for a sweep in the order of the values.
    - `keep`, `skip`: numbers of periods of the force that are kept, and left out before them.
    - `repeats`: largest difference of states that are the same, in units of the largest state.
    - `tolerance`, `step`: as for `solve`, or `simulate`.

    **Raises** `ValueError` for a period that is not positive, and a parameter that is not one real
    number; `TypeError` for arguments of the wrong type.
    """
    check_kind("sweep", sweep, AbstractSweep, "WithMemory()")
    keep, skip = whole("keep", keep, least=2), whole("skip", skip, least=0)
    swept = jnp.atleast_1d(jnp.asarray(real("values", values), float))
    make = oscillator_sampler if isinstance(system, ImpactOscillator) else system_sampler
    run, begun = make(system, start, period, where, Counts(keep, skip), tolerance, step)
    return _swept(sweep, run, begun, swept, jnp.asarray(repeats, float))


@eqx.filter_jit
def _swept(
    sweep: AbstractSweep, run: AbstractSampler, start: PyTree, values: Array, repeats: Scalar
) -> Diagram:
    found = sweep.sections(run, start, values)
    rows = jax.vmap(jax.vmap(packed))(found.states)
    period = jax.vmap(lambda states: period_of(states, repeats))(rows)
    return Diagram(values, found.states, period, found.result)


def period_of(states: Float[Array, "keep numbers"], repeats: Scalar) -> Code:
    """The least number of rows after which rows repeat, at most half of them; 0 if they do not."""
    count = states.shape[0]
    size = jnp.max(jnp.abs(states), axis=0)
    scaled = states / jnp.where(size > 0, size, 1.0)
    later = [jnp.max(jnp.abs(scaled[lag:] - scaled[:-lag])) for lag in range(1, count // 2 + 1)]
    same = jnp.stack(later) <= repeats
    return jnp.where(jnp.any(same), jnp.argmax(same) + 1, 0).astype(jnp.int32)
