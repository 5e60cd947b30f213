"""Motion of a system that does not depend on time, from one crossing of a surface to another."""

import jax
import jax.numpy as jnp
import numpy as np

from impactjax._hybrid.lane import Start
from impactjax._hybrid.numbers import packed
from impactjax._hybrid.section import section
from impactjax._hybrid.surface import AbstractSurface, Marked
from impactjax._hybrid.system import HybridSystem
from impactjax._response.first_motion import Accuracy, Motion, happened, rates_at
from impactjax._response.rhythm import OfMotion
from impactjax._results import RESULTS

_LONGER = 1.5  # times the return before, within which one is expected


def returning_motion(
    system: HybridSystem,
    start: Start,
    surface: AbstractSurface,
    multiple: int,
    settle: int,
    accuracy: Accuracy,
) -> Motion:
    """The motion from a crossing of a surface to the one that follows after `multiple`, once it has
    settled for `settle` times as long and one such return has told how long it takes.

    **Raises** `ValueError` for a motion that does not return, and a system that depends on time.
    """
    seen = section(
        *(system, start, surface),
        keep=multiple + 1,
        skip=settle * multiple,
        tolerance=accuracy.tolerance,
        scale=accuracy.scale,
        step=accuracy.step,
    )
    _check_returns(bool(seen.result == RESULTS.successful) and bool(np.all(np.isfinite(seen.t))))
    marked, begin = Marked(system, surface), np.asarray(seen.t[-1])
    until = begin + _LONGER * (seen.t[-1] - seen.t[0])
    found = happened(accuracy.followed(marked, seen.final, until).events)
    (crossings,) = np.nonzero(found.transition == marked.number())
    _check_returns(crossings.size >= multiple)
    last = crossings[multiple - 1]
    rows = np.arange(last + 1)
    rows = rows[found.transition[rows] < len(system.transitions())]
    events = jax.tree.map(lambda column: column[rows], found)
    events = events._replace(t=events.t - begin, until=events.until - begin, mode=events.mode[0])
    begun = Start(start.t, seen.final.y, seen.final.mode[0])
    duration = float(found.t[last] - begin)
    rates = rates_at(system, begun, jnp.asarray(duration), 0.0)
    if not np.array_equal(*rates):
        raise ValueError(
            "Argument `period` is a surface, but the rates of the system change with time: give "
            "the period of its force."
        )
    return Motion(begun, duration, OfMotion(np.asarray(packed(begun.y)), rates[0]), events)


def _check_returns(returns: bool) -> None:
    if not returns:
        raise ValueError("The motion does not return to the surface given as `period`.")
