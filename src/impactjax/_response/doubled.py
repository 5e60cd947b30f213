"""The verb `doubled`: the orbit of twice the period that branches off at a period doubling."""

import jax
import numpy as np

from impactjax._refusal import check_kind
from impactjax._response.linear import Cycle, Linear, linearised
from impactjax._response.newton import Constraint, sizes_of, solved
from impactjax._response.orbit import Orbit, orbit_of

_FLIP = 1e-6  # distance of a multiplier from −1
_VARIES = 1e-12  # equations that change less with their parameter have none


def doubled(orbit: Orbit, distance: float = 0.01) -> Orbit:
    """The orbit of twice the period that branches off at a period doubling.

    Its two halves differ by twice `distance` along the disturbance that changes its sign in a
    period; the parameter of the branch is found with the orbit. `follow` goes on from there.

    **Arguments:**

    - `orbit`: the orbit of a special point of this kind, of a branch made by `follow`.
    - `distance`: in units in which the period and the largest values of the state are 1. The
      parameter then lies about distance² from the period doubling.

    **Raises** `ValueError` for an orbit that has no multiplier −1, and one that is not of a branch;
    `TypeError` for arguments of the wrong type.
    """
    check_kind("orbit", orbit, Orbit, "branch.special[0].orbit")
    single = orbit.linear
    if not np.min(np.abs(orbit.multipliers + 1)) < _FLIP:
        raise ValueError(
            "Argument `orbit` must be the orbit of a period doubling, but its multipliers are "
            f"{orbit.multipliers}."
        )
    sizes = sizes_of(single, 1.0)
    if not np.max(np.abs(single.by_parameter / single.row_sizes(sizes))) > _VARIES:
        raise ValueError("Argument `orbit` must be an orbit of a branch: see `follow`.")
    flip = np.linalg.svd((single.inner - single.wrap) * sizes[:-1])[2][-1]
    twice = _twice(single)
    sizes = sizes_of(twice, 1.0)
    row = np.concatenate([flip, -flip, [0.0]]) / np.sqrt(2)
    value = float(row @ (twice.unknowns / sizes)) + np.sqrt(2) * distance
    guess = twice.unknowns + np.sqrt(2) * distance * row * sizes
    found = solved(linearised(twice.cycle, guess), sizes, Constraint(row, value))
    return orbit_of(found.linear, sizes, found.converged)


def _twice(single: Linear) -> Linear:
    """An orbit taken twice, as one of twice the period."""
    cycle, arcs = single.cycle, single.cycle.arcs(single.unknowns)
    itinerary = jax.tree.map(lambda leaf: np.concatenate([leaf, leaf]), cycle.itinerary)
    doubled_cycle = Cycle(cycle.family, itinerary, 2 * cycle.multiple, cycle.phase)
    first, second = arcs, arcs._replace(t=arcs.t + single.period)
    both = jax.tree.map(lambda a, b: np.concatenate([a, b]), first, second)
    return linearised(doubled_cycle, doubled_cycle.packed(both, float(single.unknowns[-1])))
