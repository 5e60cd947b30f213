"""The verb `diagram`: stroboscopic states of a forced system over values of a parameter."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int, PyTree

from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.system import HybridSystem, State
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState
from impactjax._refusal import check_kind, whole
from impactjax._response.forced import forced
from impactjax._response.parameter import Where, place_of
from impactjax._response.period import Period
from impactjax._response.portions import in_portions
from impactjax._response.repetition import in_units, periods_of, rows_of
from impactjax._response.sampler import Counts, Sampled
from impactjax._response.swept import Swept, as_values
from impactjax._results import RESULTS
from impactjax._simulate.step import AbstractStep
from impactjax._types import Numbers, Scalar


class AbstractSweep(eqx.Module):
    """Rule for the start at each value of a sweep."""

    @abc.abstractmethod
    def sections(self, swept: Swept, values: Float[Array, " values"]) -> Sampled:
        """The states at all values."""


class FreshStarts(AbstractSweep):
    """The same start at each value: all run side by side, on all processors."""

    def sections(self, swept: Swept, values: Float[Array, " values"]) -> Sampled:
        return in_portions(_side_by_side, swept, values)


class WithMemory(AbstractSweep):
    """Each value starts where the one before has ended, so that the motion follows a branch as far
    as it is stable. The order of the values is the direction of the sweep. An oscillator ends with
    its last whole step, so that the value changes up to a step before the end of a period.
    """

    def sections(self, swept: Swept, values: Float[Array, " values"]) -> Sampled:
        return _one_after_another(swept, values)


@eqx.filter_jit
def _side_by_side(swept: Swept, values: Float[Array, " values"]) -> Sampled:
    def motion(value: Scalar) -> Sampled:
        return swept.states(value, swept.begun(value))

    return swept.forced.run.side_by_side(motion, values)


@eqx.filter_jit
def _one_after_another(swept: Swept, values: Float[Array, " values"]) -> Sampled:
    def one(begun: PyTree, value: Scalar) -> tuple[PyTree, Sampled]:
        found = swept.states(value, begun)
        return found.following, found

    return jax.lax.scan(one, swept.begun(values[0]), values)[1]


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
    at = as_values(values)
    own = forced(system, start, period, Counts(keep, skip), tolerance, step)
    found = sweep.sections(Swept(own, place_of(own.system, where)), at)
    rows = rows_of(found.states)
    sizes = jnp.max(jnp.abs(rows), axis=1, keepdims=True)
    return Diagram(at, found.states, periods_of(in_units(rows, sizes), repeats), found.result)
