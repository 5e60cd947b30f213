"""The verb `basins`: the attractor that each of many motions of a forced system approaches."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Int

from impactjax._hybrid.lane import Start
from impactjax._hybrid.method import AbstractMethod
from impactjax._hybrid.system import HybridSystem, State
from impactjax._known import is_known, known
from impactjax._model.impact_oscillator import ImpactOscillator
from impactjax._model.initial_state import InitialState, check_angle
from impactjax._refusal import check_kind, of_kind, whole
from impactjax._response.attractors import Labels, attractor_of_each
from impactjax._response.forced import Forced, forced
from impactjax._response.period import Period
from impactjax._response.portions import in_portions
from impactjax._response.repetition import in_units, periods_of, rows_of
from impactjax._response.sampler import Counts, Sampled
from impactjax._results import RESULTS
from impactjax._simulate.step import AbstractStep
from impactjax._types import Scalar


class Attractor(NamedTuple):
    """A periodic motion that others approach.

    - `period`: number of periods of the force after which it repeats.
    - `states`: its states after each of them.
    - `share`: share of the starts from which motions approach it.
    """

    period: int
    states: State
    share: float


class Basins(eqx.Module):
    """Basins of attraction, over the starts of motions.

    - `attractor`: index of the attractor that each motion approaches; −1 for a motion that has
      failed, or that does not repeat: it is quasi-periodic, chaotic or not yet settled.
    - `attractors`: those found, the one with the largest share first.
    - `result`: result codes.
    """

    attractor: Int[np.ndarray, " starts"]
    attractors: tuple[Attractor, ...]
    result: RESULTS


def basins(
    system: HybridSystem | ImpactOscillator,
    starts: Start | InitialState,
    period: Period,
    *,
    keep: int = 16,
    skip: int = 300,
    repeats: float = 1e-6,
    same: float = 1e-3,
    tolerance: ArrayLike | None = None,
    step: AbstractMethod | AbstractStep | None = None,
) -> Basins:
    """Basins of attraction of a forced system: which of its periodic motions each start leads to.

    All motions run side by side, on all processors, with progress on a terminal.

    **Arguments:**

    - `system`: a hybrid system, or an `ImpactOscillator`, which runs by `simulate`.
    - `starts`: a `Start` whose numbers in `y` are arrays of one axis, or an `InitialState` of such
      arrays, at time 0: one number for each motion.
    - `period`: period of the force: a number, or a function of the system.
    - `keep`, `skip`: numbers of periods of the force that are compared, and left out before them.
    - `repeats`: largest difference of states that repeat, in units of the largest state of all.
    - `same`: largest difference of states of one attractor, in the same units.
    - `tolerance`, `step`: as for `solve`, or `simulate`.

    **Raises** `ValueError` for starts that are no arrays of one axis, a period or a difference that
    is not positive, and under `jit`; `TypeError` for arguments of the wrong type.
    """
    keep, skip = whole("keep", keep, least=2), whole("skip", skip, least=0)
    if not is_known((system, starts)):
        raise ValueError("`basins` compares numbers that must be known: call it outside of `jit`.")
    if not np.asarray(same) > 0:
        raise ValueError(f"Argument `same` must be positive, but it is {same}.")
    if isinstance(system, ImpactOscillator):
        of_angles = of_kind("starts", InitialState, "InitialState(angles)")(starts)
        check_angle(system.oscillator, of_angles)
    else:
        check_kind("starts", starts, Start, "Start(0.0, y)")
    numbers = _numbers(starts)
    first = _with_numbers(starts, [each[0] for each in numbers])
    own = forced(system, first, period, Counts(keep, skip), tolerance, step)
    found = known(in_portions(_side_by_side, own, numbers))
    good = found.result == RESULTS.successful
    rows = np.asarray(rows_of(found.states))
    sizes = np.max(np.abs(rows), axis=(0, 1), where=good[:, None, None], initial=0.0)
    rows = np.asarray(in_units(rows, sizes))
    repeat = periods_of(rows, repeats) > 0
    periods = np.where(good & repeat, periods_of(rows, same), 0)
    of_each = attractor_of_each(rows, periods, same)
    attractors = [
        _attractor(found.states, periods, of_each == name) for name in range(of_each.max() + 1)
    ]
    return Basins(of_each, tuple(attractors), found.result)


def _attractor(states: State, periods: Labels, own: Bool[np.ndarray, " starts"]) -> Attractor:
    """The attractor of some motions, with the states of the first of them."""
    first = np.flatnonzero(own)[0]
    period = int(periods[first])
    return Attractor(
        period, jax.tree.map(lambda leaf: leaf[first, -period:], states), float(np.mean(own))
    )


@eqx.filter_jit
def _side_by_side(own: Forced, numbers: tuple[Array, ...]) -> Sampled:
    def motion(numbers: tuple[Scalar, ...]) -> Sampled:
        start = _with_numbers(own.start, numbers)
        return own.run(own.system, own.run.begun(own.system, start))

    return own.run.side_by_side(motion, numbers)


def _numbers(starts: Start | InitialState) -> tuple[Array, ...]:
    """The numbers of the starts, each an array over all of them."""
    of_mass = isinstance(starts, InitialState)
    leaves = jax.tree.leaves(starts if of_mass else starts.y)
    try:
        numbers = np.broadcast_arrays(*(np.asarray(leaf, float) for leaf in leaves))
    except ValueError as error:
        raise ValueError(f"Argument `starts` has arrays of different shapes: {error}.") from error
    if not numbers or numbers[0].ndim != 1 or not numbers[0].size:
        raise ValueError(
            "Argument `starts` must hold arrays of one axis, with one number for each motion, but "
            f"their shape is {numbers[0].shape if numbers else None}."
        )
    return tuple(jnp.asarray(each) for each in numbers)


def _with_numbers(
    start: Start | InitialState, numbers: Sequence[ArrayLike]
) -> Start | InitialState:
    """The start of one motion."""
    if isinstance(start, InitialState):
        return InitialState(*numbers)
    y = jax.tree.unflatten(jax.tree.structure(start.y), numbers)
    return Start(start.t, y, start.mode)
